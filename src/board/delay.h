/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: pauses that are too short for a timer.
 */
#ifndef BOARD_DELAY_H
#define BOARD_DELAY_H

#include <stdint.h>
#include "board/timer.h"

/* Ticks of a constant time, rounded up. */
#define DELAY_NS(NS) \
    ((uint32_t)(((uint64_t)(NS) * (CONFIG_CLOCK_FREQ / 1000) + 999999) / 1000000))

/* --- The port may provide, as macros in port.h --- */

/* PORT_DELAY_STAMP(), delay_stamp_t: where reading the clock takes too long. */
#ifndef PORT_DELAY_STAMP
typedef uint32_t delay_stamp_t;
#define PORT_DELAY_STAMP timer_read_clock
#endif

/* What passes anyway from one pulse to the next, in ns: about a dozen
 * instructions. */
#ifndef PORT_DELAY_LOOP_NS
#define PORT_DELAY_LOOP_NS 0
#endif

/* Irqs off: the low bits of the clock, to subtract an earlier stamp. */
static inline delay_stamp_t delay_stamp(void)
{
    return PORT_DELAY_STAMP();
}

/* PORT_DELAY_TICKS().  Any context: do nothing for at least `ticks`, and with
 * irqs off for hardly more.  Where reading the clock takes longer than a pulse may, constant
 * `ticks` must become counted instructions. */
static inline __attribute__((always_inline)) void delay_ticks(uint32_t ticks)
{
#ifdef PORT_DELAY_TICKS
    PORT_DELAY_TICKS(ticks);
#else
    uint32_t start = timer_read_clock();

    while (timer_read_clock() - start < ticks)
        ;
#endif
}

#endif
