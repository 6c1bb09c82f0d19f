/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A board for tests: 256 pins, a virtual clock, and interrupts wherever a test
 * wants one.
 *
 * The firmware passes a point each time interrupts become enabled.  At point
 * number `inject_at` an interrupt strikes: time jumps to the first timer and
 * that runs, whatever the task was doing.
 */
#ifndef FAKEBOARD_H
#define FAKEBOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { FAKE_MAX_EDGES = 4096, FAKE_RX_SIZE = 240 };

struct fake_edge {
    uint32_t clock;
    uint8_t pin, level;
};

struct fakeboard {
    uint32_t clock;
    uint32_t timer;         /* when the first timer is due */
    bool irqs_off, in_irq;
    uint32_t points, inject_at;
    uint32_t events_left;   /* fake_run() ends when these have run */
    uint32_t run_until;
    struct fake_edge edges[FAKE_MAX_EDGES];
    uint32_t n_edges;
    uint8_t levels[256], inputs[256];
    bool is_adc_busy;
    uint32_t adc_ready;        /* clock */
    uint32_t n_samples, noise; /* of the converter; what devices answer */
    uint8_t rx[FAKE_RX_SIZE], rx_len;
    bool (*feed)(void);     /* when idle: sends more, or returns false */
    void (*note_message)(const uint8_t *payload, uint8_t len); /* sent */
    uint8_t next_seq;       /* as the firmware's last block said */
    uint32_t n_blocks;
};

extern struct fakeboard fake;

/* The firmware is about to access memory (interleave.c): a point, too. */
void fake_note_access(void);

/* Bytes arrive; false if they do not fit. */
bool fake_receive(const uint8_t *data, size_t len);

/* The checksum and the end of a block of which `len` bytes are there. */
void fake_put_trailer(uint8_t *block, size_t len);

/* A block with this payload arrives, framed as it should be. */
bool fake_send(const uint8_t *payload, size_t len);

/* Run the firmware, from its start or where it was, until it has no input left
 * and the clock is `until`, or `max_events` timers have run. */
void fake_run(uint32_t until, uint32_t max_events);

#endif
