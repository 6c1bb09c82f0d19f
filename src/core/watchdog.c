/* SPDX-License-Identifier: GPL-3.0-or-later
 * Keeps the watchdog quiet while timers and tasks run.
 *
 * A timer wakes the task, so that a main loop that sleeps is not taken for one
 * that hangs, and a dead timer interrupt does not go unnoticed.
 */
#include "board/timer.h"
#include "board/watchdog.h"
#include "core/sched.h"

#define PET_US 100000
/* Not at the same time as what has a round period */
#define FIRST_PET_US 73000

static struct task_wake pet_wake;

static bool pet_event(struct timer *timer)
{
    sched_wake(&pet_wake);
    timer->waketime += timer_from_us(PET_US);
    return TIMER_AGAIN;
}

static struct timer pet_timer = { .event = pet_event };

void watchdog_task(void)
{
    if (sched_take(&pet_wake))
        watchdog_pet();
}
DECL_TASK(watchdog_task);

/* At start, and after a shutdown has emptied the list of timers. */
void watchdog_restart(void)
{
    watchdog_pet();
    pet_timer.waketime = timer_read_clock() + timer_from_us(FIRST_PET_US);
    sched_add_timer(&pet_timer);
}
DECL_INIT(watchdog_restart);
DECL_SHUTDOWN(watchdog_restart);
