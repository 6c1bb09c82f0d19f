/* SPDX-License-Identifier: GPL-3.0-or-later
 * State of the fake board: one file, DIR/board, mapped by the firmware and by
 * whoever watches it.  It outlives a reset, as a machine outlives that of its
 * mcu: inputs, readings, positions stay; outputs are let go.
 *
 * The watcher writes `input` and `reading`; all else belongs to the firmware.
 * Numbers are in the machine's byte order.
 */
#ifndef LINUX_FAKE_H
#define LINUX_FAKE_H

#include <stdint.h>
#include "pins.h"

#define FAKE_MAGIC "fakemcu1"
#define FAKE_STEPPERS 16
#define FAKE_EDGES 65536 /* in the ring */

enum fake_mode { FAKE_UNUSED, FAKE_INPUT, FAKE_OUTPUT, FAKE_PWM, FAKE_ANALOG };
enum { FAKE_INPUT_PULL = 2 }; /* input: nothing connected but the pull */

struct fake_header {
    char magic[8];
    uint32_t pin_count, edge_size, stepper_count;
    uint32_t boots;       /* starts of the firmware */
    uint64_t start_ns;    /* CLOCK_MONOTONIC at clock 0 of this start */
    uint64_t edge_count;  /* ever; the last is at (edge_count - 1) % size */
    uint64_t unused[3];
};

struct fake_stepper {
    int64_t position;     /* steps forward less steps back */
    uint64_t total;       /* steps both ways */
};

struct fake_pin {
    uint8_t mode;         /* enum fake_mode */
    uint8_t level;
    uint8_t input;        /* 0, 1 or FAKE_INPUT_PULL */
    int8_t pull;
    uint32_t edges;       /* ever */
    uint64_t changed;     /* clock of the last edge */
    uint64_t on_ticks;    /* sum of times at level 1, up to the last edge */
    uint64_t cycle_ns, on_ns; /* of a pwm channel */
    uint32_t reading;     /* of an analog input, 0..4095 */
    uint32_t unused;
};

struct fake_edge {
    uint64_t clock;
    uint32_t pin, level;
};

struct fake_board {
    struct fake_header header;
    struct fake_stepper steppers[FAKE_STEPPERS];
    struct fake_pin pins[PINS_END];
    struct fake_edge edges[FAKE_EDGES];
};

extern struct fake_board *fake_board;

/* fake_rules.c: read DIR/rules, where there is one; 0, or -1 after a message. */
int fake_rules_read(const char *folder);

/* A pin changes: count the steps of whoever it drives. */
void fake_rules_note_edge(uint32_t pin, uint8_t level);

/* The level of a switch on this pin, -1 if there is none. */
int fake_rules_read_switch(uint32_t pin);

#endif
