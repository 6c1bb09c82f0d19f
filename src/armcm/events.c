/* SPDX-License-Identifier: GPL-3.0-or-later
 * The timer interrupt: runs what is due, then sets the alarm for the next.
 *
 * Most events are steps, most of these are one edge at a pin (stepper_head),
 * and most often the stepper is still the first of the list afterwards: that way
 * is short.  The words of such a timer lie in a row; reading them with one
 * instruction saves a third of it on a Cortex-M0 and some on others.
 */
#include <stddef.h>

#include "armcm/alarm.h"
#include "armcm/burst.h"
#include "board/gpio.h"
#include "board/irq.h"
#include "board/timer.h"
#include "core/sched.h"
#include "motion/stepper.h"

/* Steps that catch up: no edge of a motor comes closer to the one before than
 * drivers can tell.  From edge to edge are 35 instructions, more than 100 ns on
 * slower chips. */
#define HAS_TO_SPACE (CONFIG_CLOCK_FREQ > 320000000)

_Static_assert(offsetof(struct stepper_head, timer.event) == 4
               && offsetof(struct stepper_head, timer.waketime) == 8
               && offsetof(struct stepper_head, interval) == 12
               && offsetof(struct stepper_head, add) == 16
               && offsetof(struct stepper_head, count) == 20,
               "LOAD_HEAD and STORE_HEAD know these");

/* Variables with the first six words of the timer at `place`, whatever it is,
 * and `place` behind them.  A call makes these variables void: what is used in
 * between is ALWAYS_INLINE. */
#define LOAD_HEAD(PLACE) \
    register struct timer *next __asm__("r1"); \
    register bool (*event)(struct timer *) __asm__("r2"); \
    register uint32_t waketime __asm__("r3"); \
    register uint32_t interval __asm__("r4"); \
    register uint32_t add __asm__("r5"); \
    register uint32_t count __asm__("r6"); \
    __asm__ volatile( \
        "ldmia %0!, {r1-r6}" \
        : "+l"(PLACE), "=r"(next), "=r"(event), "=r"(waketime), \
          "=r"(interval), "=r"(add), "=r"(count) :: "memory")

/* Write the third, fourth and sixth back; `place` points to the fifth. */
#define STORE_HEAD(PLACE) do { \
        PLACE -= 4; \
        __asm__ volatile( \
            "stmia %0!, {r3, r4}\n\tstr %3, [%0, #4]" \
            : "+l"(PLACE) \
            : "r"(waketime), "r"(interval), "l"(count) : "memory"); \
    } while (0)

static inline struct stepper_head *head_at(uint32_t *fifth)
{
    return (void *)(fifth - offsetof(struct stepper_head, add) / 4);
}

uint32_t timer_from_us(uint32_t us)
{
    return us * US_TICKS;
}

/* The sentinel lies so far ahead when the search for a place begins (sched.c
 * may put it half as far), and longer intervals are not for the search: so it
 * ends there. */
#define SENTINEL_LEAD (UINT32_C(1) << 29)
#define SEARCH_LIMIT (UINT32_C(1) << 26)

/* The first timer of the list has a new time, which does not come before that
 * of the second: to its new place. */
static inline void move_first(struct timer *timer, struct timer *second,
                              uint32_t waketime)
{
    struct timer *other, *next = second;

    do {
        other = next;
        next = other->next;
    } while (!timer_is_before(waketime, next->waketime));
    sched_first = second;
    timer->next = next;
    other->next = timer;
}

/* Too much at once: let others run for a moment. */
static __attribute__((noinline)) void pause_burst(uint32_t next)
{
    uint32_t now = timer_read_clock();

    if ((int32_t)(now - next) > (int32_t)LATE_TICKS)
        sched_shutdown_late();
    alarm_set(now + PAUSE_TICKS + ENTRY_TICKS, PAUSE_TICKS + ENTRY_TICKS);
}

/* Hops, events that are near, long bursts.  Returns true when `next` is due. */
static __attribute__((noinline)) bool wait_event(uint32_t next, uint32_t start)
{
    uint32_t now = timer_read_clock();

    if (now - start > BURST_TICKS) {
        pause_burst(next);
        return false;
    }
    if ((int32_t)(next - now) > NEAR_TICKS) {
        timer_kick(next);
        return false;
    }
    while ((int32_t)(next - now) > LEAD_TICKS)
        now = timer_read_clock();
    return true;
}

/* Make the steps that are due, one after the other, until there is something
 * else to do or the clock has passed `end`.  Returns the clock after them.  A
 * function without calls, for which the registers suffice. */
static __attribute__((noinline)) uint32_t run_steps(uint32_t now, uint32_t end)
{
    struct timer *made = NULL;
    uint32_t made_at = now;

    for (;;) {
        uint32_t *place = (uint32_t *)sched_first;
        LOAD_HEAD(place);

        if ((int32_t)(waketime - now) > LEAD_TICKS
            || event != stepper_edge_event || !timer_is_before(now, end)
            || interval >= SEARCH_LIMIT || !--count)
            return now;
        if (HAS_TO_SPACE) {
            while (made == sched_first
                   && timer_read_clock() - made_at < STEPPER_EDGE_TICKS)
                ;
            made = sched_first;
            made_at = timer_read_clock();
        }
        waketime += interval;
        interval += add;
        STORE_HEAD(place);
        gpio_toggle_irq(head_at(place)->step_pin);
        if (!timer_is_before(waketime, next->waketime))
            move_first(&head_at(place)->timer, next, waketime);
        now = timer_read_clock();
    }
}

/* What the short way leaves.  `moved`: made a step, is no longer the first. */
static __attribute__((noinline)) void run_events(struct timer *moved)
{
    uint32_t start = timer_read_clock(), now = start;

    alarm_begin();
    sched_sentinel.waketime = start + SENTINEL_LEAD;
    if (moved) {
        sched_move_timer(moved, moved->waketime);
        now = timer_read_clock(); /* an alarm that has passed would be lost */
    }
    for (;;) {
        uint32_t next = sched_first->waketime, ahead = next - now;

        if ((int32_t)ahead > LEAD_TICKS || now - start > BURST_TICKS) {
            if ((ahead - NEAR_TICKS) >> REACH_BITS == 0) {
                alarm_set(next, next - timer_read_clock());
                return;
            }
            if (!wait_event(next, start))
                return;
        }
        sched_run_timer();
        now = run_steps(timer_read_clock(), start + BURST_TICKS);
    }
}

/* Most often there is one step, and the next is within reach, but not near.
 * (Where the clock is read decides what fits into the registers.) */
void armcm_timer_irq(void)
{
    uint32_t *place = (uint32_t *)sched_first, ahead;
    struct timer *moved = NULL;
    LOAD_HEAD(place);

    if (event != stepper_edge_event
        || (int32_t)(waketime - timer_read_clock()) > LEAD_TICKS || !--count)
        goto others;
    waketime += interval;
    interval += add;
    STORE_HEAD(place);
    gpio_toggle_irq(head_at(place)->step_pin);
    if (!timer_is_before(waketime, next->waketime)) {
        moved = &head_at(place)->timer;
        goto others;
    }
    ahead = waketime - timer_read_clock();
    if ((ahead - NEAR_TICKS) >> REACH_BITS)
        goto others;
    alarm_set(waketime, ahead);
    return;
others:
    run_events(moved);
}
