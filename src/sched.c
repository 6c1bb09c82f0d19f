/* SPDX-License-Identifier: GPL-3.0-or-later
 * Tasks, timers and shutdown. */
#include <setjmp.h>
#include <stddef.h>

#include "board/irq.h"
#include "board/timer.h"
#include "core/load.h"
#include "core/sched.h"
#include "core/tables.h"

/* How far ahead the sentinel is put when nothing else waits. */
#define SENTINEL_LEAD (UINT32_C(1) << 28)

DECL_CONSTANT("CLOCK_FREQ", CONFIG_CLOCK_FREQ);


/* ---- Timers ---- */

#if CONFIG_HAVE_SLOW_EVENTS
/* These are for steps; the others are in core/slow_events.c. */
#define sched_add_timer sched_add_step
#define sched_del_timer sched_del_step
#endif

/* It only gives an empty list a time to wake at. */
static bool sentinel_event(struct timer *timer)
{
    (void)timer;
    return TIMER_DONE;
}

struct timer sched_sentinel = { .event = sentinel_event };
struct timer *sched_first = &sched_sentinel;

/* The last timer of the list, from `other` on, that does not come after `clock`.
 * `other` does not; the sentinel does. */
static inline struct timer *seek_timer(struct timer *other, uint32_t clock)
{
#ifdef PORT_HAS_SEEK_TIMER
    return port_seek_timer(other, clock, &sched_sentinel);
#else
    struct timer *next = other->next;

    while (next != &sched_sentinel && !timer_is_before(clock, next->waketime)) {
        other = next;
        next = next->next;
    }
    return other;
#endif
}

static void insert_timer(struct timer *timer)
{
    struct timer *first = sched_first, *other;

    if (first == &sched_sentinel
        || timer_is_before(timer->waketime, first->waketime)) {
        timer->next = first;
        sched_first = timer;
        return;
    }
    other = seek_timer(first, timer->waketime);
    timer->next = other->next;
    other->next = timer;
}

void sched_add_timer(struct timer *timer)
{
    irq_flag_t flag;

    if (timer_is_before(timer->waketime, timer_read_clock()))
        try_shutdown("Timer too close");
    flag = irq_save();
    insert_timer(timer);
    if (sched_first == timer)
        timer_kick(timer->waketime);
    irq_restore(flag);
}

static void unlink_timer(const struct timer *timer)
{
    struct timer **link = &sched_first;

    while (*link && *link != timer)
        link = &(*link)->next;
    if (*link)
        *link = timer->next;
    if (sched_first == &sched_sentinel)
        sched_sentinel.waketime = timer_read_clock() + SENTINEL_LEAD;
}

#if !CONFIG_HAVE_SLOW_EVENTS
void sched_move_timer(struct timer *timer, uint32_t waketime)
{
    unlink_timer(timer);
    timer->waketime = waketime;
    insert_timer(timer);
}
#endif

void sched_del_timer(struct timer *timer)
{
    irq_flag_t flag = irq_save();
    bool is_first = sched_first == timer;

    unlink_timer(timer);
    if (is_first)
        timer_kick(sched_first->waketime);
    irq_restore(flag);
}

/* The list has changed, or the timer is done. */
static __attribute__((noinline)) uint32_t settle(struct timer *timer,
                                                 bool again)
{
    if (timer != &sched_sentinel)
        unlink_timer(timer);
    else
        timer->waketime += SENTINEL_LEAD;
    if (again)
        insert_timer(timer);
    return sched_first->waketime;
}

/* The timer stays in the list while its event runs: most often it is the first
 * again. */
uint32_t sched_run_timer(void)
{
    struct timer *timer = sched_first, *other;
    bool again = timer->event(timer);
    uint32_t waketime;

    if (!again || sched_first != timer)
        return settle(timer, again);
    waketime = timer->waketime;
    other = seek_timer(timer, waketime);
    if (other == timer)
        return waketime;
    sched_first = timer->next;
    timer->next = other->next;
    other->next = timer;
    return sched_first->waketime;
}

void sched_shutdown_late(void)
{
    try_shutdown("Rescheduled timer in the past");
}

static void reset_timers(void)
{
    sched_sentinel.waketime = timer_read_clock() + SENTINEL_LEAD;
    sched_first = &sched_sentinel;
    timer_kick(sched_sentinel.waketime);
    sched_reset_slow();
}


/* ---- Tasks ---- */

static volatile uint8_t has_work;

void sched_wake(struct task_wake *wake)
{
    wake->is_set = 1;
    has_work = 1;
}

bool sched_take(struct task_wake *wake)
{
    if (!wake->is_set)
        return false;
    wake->is_set = 0;
    return true;
}

/* Sleep while no task has anything to do.  Returns the clock at waking.  A task
 * that is woken once the flag is clear runs in the next pass. */
static uint32_t sleep_idle(uint32_t busy_since)
{
    if (!has_work) {
        load_note(timer_read_clock() - busy_since);
        irq_disable();
        while (!has_work)
            irq_wait();
        irq_enable();
        busy_since = timer_read_clock();
    }
    has_work = 0;
    return busy_since;
}

static void run_tasks(void)
{
    uint32_t busy_since = timer_read_clock();

    for (;;) {
        irq_poll();
        tables_run_tasks();
        busy_since = sleep_idle(busy_since);
    }
}


/* ---- Shutdown ---- */

static jmp_buf main_loop;
static volatile uint16_t shutdown_reason;
static volatile uint32_t shutdown_clock;

bool sched_is_shutdown(void)
{
    return shutdown_reason != 0;
}

void sched_clear_shutdown(void)
{
    if (!shutdown_reason)
        shutdown("Shutdown cleared when not shutdown");
    shutdown_reason = 0;
}

void sched_report_shutdown(void)
{
    sendf("is_shutdown static_string_id=%hu", shutdown_reason);
}

void sched_try_shutdown(uint16_t reason)
{
    if (!shutdown_reason)
        sched_shutdown(reason);
}

void sched_shutdown(uint16_t reason)
{
    irq_disable();
    if (!shutdown_reason) {
        shutdown_reason = reason;
        shutdown_clock = timer_read_clock();
    }
    longjmp(main_loop, 1);
}

static void stop_everything(void)
{
    irq_disable();
    reset_timers();
    tables_run_shutdowns();
    sendf("shutdown clock=%u static_string_id=%hu", shutdown_clock,
          shutdown_reason);
    has_work = 1;
    irq_enable();
}

void sched_main(void)
{
    irq_disable();
    reset_timers();
    if (!setjmp(main_loop)) {
        irq_enable();
        tables_run_inits();
        sendf("starting");
    } else {
        stop_everything();
    }
    run_tasks();
    __builtin_unreachable();
}
