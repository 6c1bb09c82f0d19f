/* SPDX-License-Identifier: GPL-3.0-or-later
 * PRU0: what src/sched.c is elsewhere, for tasks and one timer. */
#include "board/timer.h"
#include "core/load.h"
#include "core/sched.h"
#include "sched0.h"

static struct timer *only_timer;


/* ---- Tasks ---- */

void sched_wake(struct task_wake *wake)
{
    wake->is_set = 1;
}

bool sched_take(struct task_wake *wake)
{
    bool was_set = wake->is_set;

    wake->is_set = 0;
    return was_set;
}


/* ---- The timer ---- */

void sched_add_timer(struct timer *timer)
{
    only_timer = timer;
}

void sched0_run_timer(void)
{
    if (only_timer
        && !timer_is_before(timer_read_clock(), only_timer->waketime)
        && only_timer->event(only_timer) == TIMER_DONE)
        only_timer = NULL;
}


/* ---- Load ---- */

void sched0_note(bool is_busy)
{
    static bool was_busy;
    static uint32_t since;

    if (is_busy == was_busy)
        return;
    if (is_busy)
        since = timer_read_clock();
    else
        load_note(timer_read_clock() - since);
    was_busy = is_busy;
}
