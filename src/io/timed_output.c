/* SPDX-License-Identifier: GPL-3.0-or-later
 * Outputs that change at given clocks, and must not be left on. */
#include <stddef.h>

#include "board/irq.h"
#include "board/timer.h"
#include "core/arena.h"
#include "io/timed_output.h"

struct timed_value {
    struct timed_value *next;
    uint32_t clock, value;
};

/* Set the timer for what comes next: a value, the limit, or nothing. */
static bool plan_next(struct timed_output *out, uint32_t clock,
                      bool is_default)
{
    uint32_t limit = clock + out->max_duration;
    bool has_limit = !is_default && out->max_duration;
    struct timed_value *next = out->first;

    if (next && has_limit && timer_is_before(limit, next->clock))
        sched_shutdown(out->kind->exceeds);
    out->has_limit = has_limit && !next;
    out->is_waiting = next || has_limit;
    out->timer.waketime = next ? next->clock : limit;
    return out->is_waiting;
}

static bool value_event(struct timer *timer)
{
    struct timed_output *out = CONTAINER_OF(timer, struct timed_output, timer);
    struct timed_value *head = out->first;
    uint32_t clock = timer->waketime, value;

    if (!head)
        sched_shutdown(out->kind->missed);
    value = head->value;
    out->first = head->next;
    if (!out->first)
        out->last = &out->first;
    movecell_give(head);
    return plan_next(out, clock, out->kind->apply(out, value, clock));
}

void timed_output_setup(struct timed_output *out,
                        const ROM struct timed_output_kind *kind,
                        uint32_t max_duration)
{
    out->timer.event = value_event;
    out->last = &out->first;
    out->kind = kind;
    out->max_duration = max_duration;
    movecell_request(sizeof(struct timed_value));
}

void timed_output_start(struct timed_output *out, bool is_default)
{
    irq_flag_t flag = irq_save();

    if (out->is_waiting)
        sched_del_timer(&out->timer);
    if (plan_next(out, timer_read_clock(), is_default))
        sched_add_timer(&out->timer);
    irq_restore(flag);
}

/* Irqs off: the first value of an empty queue decides the timer. */
static void wait_for(struct timed_output *out, uint32_t clock)
{
    if (out->has_limit) {
        if (timer_is_before(out->timer.waketime, clock))
            sched_shutdown(out->kind->exceeds);
        sched_del_timer(&out->timer);
        out->has_limit = false;
    }
    out->timer.waketime = clock;
    out->is_waiting = true;
    sched_add_timer(&out->timer);
}

void timed_output_queue(struct timed_output *out, uint32_t clock,
                        uint32_t value)
{
    struct timed_value *cell = movecell_take();
    irq_flag_t flag;

    cell->next = NULL;
    cell->clock = clock;
    cell->value = value;
    flag = irq_save();
    *out->last = cell;
    out->last = &cell->next;
    if (out->first == cell)
        wait_for(out, clock);
    irq_restore(flag);
}

bool timed_output_is_pending(const struct timed_output *out)
{
    return out->first != NULL;
}

void timed_output_clear(struct timed_output *out)
{
    out->first = NULL;
    out->last = &out->first;
    out->is_waiting = out->has_limit = false;
}
