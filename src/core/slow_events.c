/* SPDX-License-Identifier: GPL-3.0-or-later
 * Timers of events that give way to steps.
 *
 * They have a list of their own, and an interrupt that those of steps and of
 * the console interrupt.  Nothing of theirs touches this list: whoever works on
 * it locks the interrupt out, and leaves irqs on.
 */
#include <stddef.h>

#include "board/irq.h"
#include "board/timer.h"
#include "core/sched.h"

#define IDLE_TICKS (UINT32_C(1) << 28)
/* So many events in a row at most, then others have their turn for a moment */
#define BURST_EVENTS 8
#define PAUSE_US 20
#define LATE_US 2000

static struct timer *first;
static uint32_t pause_clock;
static bool is_paused;

static void insert(struct timer *timer)
{
    struct timer **link = &first;

    while (*link && !timer_is_before(timer->waketime, (*link)->waketime))
        link = &(*link)->next;
    timer->next = *link;
    *link = timer;
}

static void unlink(const struct timer *timer)
{
    struct timer **link = &first;

    while (*link && *link != timer)
        link = &(*link)->next;
    if (*link)
        *link = timer->next;
}

uint32_t sched_slow_clock(void)
{
    if (is_paused)
        return pause_clock;
    return first ? first->waketime : timer_read_clock() + IDLE_TICKS;
}

static void unlock(bool was_locked)
{
    if (!was_locked)
        timer_unlock_slow(sched_slow_clock());
}

irq_flag_t sched_lock_events(void)
{
    return timer_lock_slow();
}

void sched_unlock_events(irq_flag_t flag)
{
    unlock(flag);
}

void sched_add_timer(struct timer *timer)
{
    bool was_locked;

    if (timer_is_before(timer->waketime, timer_read_clock()))
        try_shutdown("Timer too close");
    was_locked = timer_lock_slow();
    insert(timer);
    unlock(was_locked);
}

void sched_del_timer(struct timer *timer)
{
    bool was_locked = timer_lock_slow();

    unlink(timer);
    unlock(was_locked);
}

void sched_move_timer(struct timer *timer, uint32_t waketime)
{
    unlink(timer);
    timer->waketime = waketime;
    insert(timer);
}

void sched_run_slow(void)
{
    uint8_t n = BURST_EVENTS;

    is_paused = false;
    for (;;) {
        struct timer *timer = first;
        uint32_t now = timer_read_clock();

        if (!timer || timer_is_before(now, timer->waketime))
            return;
        if (!n--)
            break;
        first = timer->next;
        if (timer->event(timer))
            insert(timer);
    }
    pause_clock = timer_read_clock();
    if (pause_clock - first->waketime > timer_from_us(LATE_US))
        sched_shutdown_late();
    pause_clock += timer_from_us(PAUSE_US);
    is_paused = true;
}

void sched_reset_slow(void)
{
    timer_lock_slow();
    first = NULL;
    is_paused = false;
    timer_unlock_slow(sched_slow_clock());
}
