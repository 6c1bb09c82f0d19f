/* SPDX-License-Identifier: GPL-3.0-or-later
 * The simulated mcu's view of the world it lives in.
 */
#ifndef SIMULATOR_WORLD_H
#define SIMULATOR_WORLD_H

#include <stdbool.h>
#include <stdint.h>
#include "vmcu_abi.h"

struct simulator {
    const struct vmcu_host *host;
    uint64_t now;        /* clock */
    uint64_t until;      /* run() may go up to here */
    uint32_t skew;       /* ticks that the running event has taken */
    uint16_t n_reads;    /* of the clock since time moved */
    uint32_t timer;      /* clock of the first timer, low 32 bits */
    uint64_t wake_at;    /* a waiting task wants to go on here */
    bool irqs_off;
};

extern struct simulator simulator;

/* The clock of what happens now; never goes back. */
uint64_t simulator_clock(void);

/* When the mcu has something to do again; later than `until`. */
uint64_t simulator_next_event(void);

/* Bytes arrive; 0 if they do not fit. */
int32_t simulator_console_rx(const uint8_t *buf, uint32_t len);

/* memory.c: put all variables back to what they were at first start. */
void simulator_restore_memory(void);

/* coroutine.c: start the firmware on its own stack, switch to and from it. */
void coroutine_start(void (*entry)(void));
void coroutine_enter(void);
void coroutine_leave(void);

#endif
