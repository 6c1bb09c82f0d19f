/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: the one clock of the mcu, 32 bits of ticks at CONFIG_CLOCK_FREQ.
 */
#ifndef BOARD_TIMER_H
#define BOARD_TIMER_H

#include <stdbool.h>
#include <stdint.h>
#include "port.h"

/* --- The port provides --- */

/* Any context, no blocking: the clock now, in ticks; wraps at 2^32. */
uint32_t timer_read_clock(void);

/* Any context: ticks in `us` microseconds (at most 2^32 / ticks per us). */
uint32_t timer_from_us(uint32_t us);

/* Any context, irqs off: the earliest timer changed and is due at `clock`, or
 * already passed: the timer interrupt must come then (at once if late). */
void timer_kick(uint32_t clock);

/* What the port's timer interrupt does:
 *   next = sched_run_timer();
 * again while `next` is due or too near to program; then programs `next`.
 * After a long burst (about 100 us) it lets tasks run for a moment; if `next` is
 * then more than about 1 ms in the past it calls sched_shutdown_late(). */

/* With HAVE_SLOW_EVENTS that is for steps only; all other events run in a second
 * timer interrupt that the first and those of the console may interrupt.
 * Any context: that interrupt does not come until it is unlocked; returns whether
 * it was locked before.  Unlocking tells when it is to come, at the latest. */
bool timer_lock_slow(void);
void timer_unlock_slow(uint32_t clock);

/* --- The core provides --- */

/* Second interrupt, locked, irqs on: run what is due; then when the next is. */
void sched_run_slow(void);
uint32_t sched_slow_clock(void);

/* Irq, irqs off: run the earliest timer; returns the clock of the next. */
uint32_t sched_run_timer(void);

/* Irq, irqs off: shutdown "Rescheduled timer in the past" (once). */
void sched_shutdown_late(void);

/* Any context: is clock `a` before `b`?  Right while they are less than 2^31
 * ticks apart; the only way to compare two 32 bit clocks. */
#ifndef PORT_HAS_TIMER_IS_BEFORE
static inline bool timer_is_before(uint32_t a, uint32_t b)
{
    return (int32_t)(a - b) < 0;
}
#endif

#endif
