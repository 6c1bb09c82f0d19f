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

#if TIMED_OUTPUT_REST
/* Irqs off: max_duration is over, or will be before the next value. */
static void expire(struct timed_output *out, uint16_t reason)
{
    if (!out->is_resting)
        sched_shutdown(reason);
    out->kind->rest(out);
    out->is_default = out->is_expired = true;
    sched_wake(out->kind->wake);
}

bool timed_output_take_expired(struct timed_output *out)
{
    irq_flag_t flag = irq_save();
    bool is_expired = out->is_expired;

    out->is_expired = false;
    irq_restore(flag);
    return is_expired;
}
#else
static void expire(struct timed_output *out, uint16_t reason)
{
    (void)out;
    sched_shutdown(reason);
}
#endif

/* Set the timer for what comes next: a value, the limit, or nothing. */
static bool plan_next(struct timed_output *out, uint32_t clock,
                      bool is_default)
{
    uint32_t limit = clock + out->max_duration;
    bool has_limit = !is_default && out->max_duration;
    struct timed_value *next = out->first;

    if (next && has_limit && timer_is_before(limit, next->clock))
        expire(out, out->kind->exceeds);
    out->has_limit = has_limit && !next;
    out->is_waiting = next || has_limit;
    out->timer.waketime = next ? next->clock : limit;
    return out->is_waiting;
}

static struct timed_value *drop_first(struct timed_output *out)
{
    struct timed_value *head = out->first;

    out->first = head->next;
    return head;
}

static bool value_event(struct timer *timer)
{
    struct timed_output *out = CONTAINER_OF(timer, struct timed_output, timer);
    struct timed_value *head = out->first;
    uint32_t clock;

    if (!head) {
        expire(out, out->kind->missed);
        out->has_limit = out->is_waiting = false;
        return TIMER_DONE;
    }
    clock = head->clock;
    out->is_default = out->kind->apply(out, head->value, clock);
    movecell_give(drop_first(out));
    return plan_next(out, clock, out->is_default);
}

void timed_output_setup(struct timed_output *out,
                        const struct timed_output_kind *kind,
                        uint32_t max_duration)
{
    out->timer.event = value_event;
    out->kind = kind;
    out->max_duration = max_duration;
    movecell_request(sizeof(struct timed_value));
}

void timed_output_start(struct timed_output *out, bool is_default)
{
    irq_flag_t flag = sched_lock_events();

    if (out->is_waiting)
        sched_del_timer(&out->timer);
    if (plan_next(out, timer_read_clock(), is_default))
        sched_add_timer(&out->timer);
    sched_unlock_events(flag);
}

/* The first value of an empty queue decides the timer.  Nothing but the limit
 * can happen meanwhile, and once that is gone nothing at all. */
static void wait_for(struct timed_output *out, struct timed_value *cell)
{
    irq_flag_t flag = sched_lock_events();

    if (out->has_limit) {
        if (timer_is_before(out->timer.waketime, cell->clock))
            expire(out, out->kind->exceeds);
        sched_del_timer(&out->timer);
        out->has_limit = out->is_waiting = false;
    }
    sched_unlock_events(flag);
    out->first = cell;
    out->last = &cell->next;
    out->timer.waketime = cell->clock;
    out->is_waiting = true;
    sched_add_timer(&out->timer);
}

void timed_output_queue(struct timed_output *out, uint32_t clock,
                        uint32_t value)
{
    struct timed_value *cell = movecell_take();
    bool is_only;
    irq_flag_t flag;

    cell->next = NULL;
    cell->clock = clock;
    cell->value = value;
    flag = irq_save();
    is_only = !out->first;
    if (!is_only) {
        *out->last = cell;
        out->last = &cell->next;
    }
    irq_restore(flag);
    if (is_only)
        wait_for(out, cell);
}

bool timed_output_is_pending(const struct timed_output *out)
{
    return out->first != NULL;
}

void timed_output_clear(struct timed_output *out)
{
    out->timer.event = value_event;
    out->first = NULL;
    out->is_waiting = out->has_limit = out->is_expired = false;
}
