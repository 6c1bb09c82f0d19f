/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A PIO block of an RP2040 or RP2350, cycle by cycle (RP2040 data sheet, 3).
 * What it has no model of is a fault: side-set, irq instructions, exec, joined
 * queues that are used, and automatic push and pull.
 */
#ifndef UNICORN_PIO_H
#define UNICORN_PIO_H

#include <stdbool.h>
#include <stdint.h>

enum { PIO_SMS = 4, PIO_DEPTH = 4 };

struct pio_queue { uint32_t words[PIO_DEPTH], first, count; };

struct pio_sm_state {
    uint32_t clkdiv, execctrl, shiftctrl, pinctrl;
    uint32_t x, y, isr, osr, pc, delay, phase;
    bool is_stalled;
    struct pio_queue rx, tx;
};

struct pio {
    bool is_2350;
    uint32_t enabled, inte, out, oe, sync[2];
    uint16_t program[32];
    struct pio_sm_state sm[PIO_SMS];
    uint64_t cycle, pushed_at, most_cycles; /* a sample, until its word */
    uint64_t n_overruns;        /* words that were lost */
    uint64_t n_waits;           /* cycles of a state machine without a word */
    void (*fault)(const char *what);
};

void pio_reset(struct pio *p, bool is_2350, void (*fault)(const char *));
uint32_t pio_read(struct pio *p, uint32_t offset);
void pio_write(struct pio *p, uint32_t offset, uint32_t value);
/* One cycle of the system's clock, with these levels at the pads. */
void pio_step(struct pio *p, uint32_t pads);
/* Does it wait for a level of a pin, or for nothing? */
bool pio_is_idle(const struct pio *p);
bool pio_irq(const struct pio *p);

#endif
