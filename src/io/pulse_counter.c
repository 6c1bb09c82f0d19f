/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pulse counter (tachometers): counts level changes of a polled pin. */
#include <stdbool.h>

#include "board/gpio.h"
#include "board/irq.h"
#include "board/timer.h"
#include "core/oid.h"
#include "core/sched.h"

struct counter {
    struct timer timer;
    uint32_t poll_ticks, sample_ticks;
    uint32_t next_clock;         /* of the next report */
    uint32_t count, count_clock; /* changes so far; clock of the last */
    struct gpio_in pin;
    uint8_t level;
    bool is_due;                 /* the task shall report */
};

static const ROM struct oid_kind counter_kind = { sizeof(struct counter) };
static struct task_wake counter_wake;

static bool poll_event(struct timer *timer)
{
    struct counter *c = CONTAINER_OF(timer, struct counter, timer);
    uint32_t clock = timer->waketime;
    uint8_t level = gpio_read(c->pin);

    if (level != c->level) {
        c->level = level;
        c->count++;
        c->count_clock = clock;
    }
    if (!timer_is_before(clock, c->next_clock)) {
        c->next_clock += c->sample_ticks;
        c->is_due = true;
        sched_wake(&counter_wake);
    }
    timer->waketime += c->poll_ticks;
    return TIMER_AGAIN;
}

void command_config_counter(const struct args_config_counter *args)
{
    struct gpio_in pin = gpio_setup_input(args->pin, (int8_t)args->pull_up);
    struct counter *c = oid_new(args->oid, &counter_kind);

    c->pin = pin;
    c->timer.event = poll_event;
}
DECL_COMMAND(command_config_counter, "config_counter oid=%c pin=%u pull_up=%c");

/* The count goes on where it was; poll_ticks=0 stops. */
void command_query_counter(const struct args_query_counter *args)
{
    struct counter *c = oid_lookup(args->oid, &counter_kind);

    sched_del_timer(&c->timer);
    c->is_due = false;
    if (!args->poll_ticks)
        return;
    c->level = gpio_read(c->pin);
    c->poll_ticks = args->poll_ticks;
    c->sample_ticks = args->sample_ticks;
    c->count_clock = c->timer.waketime = args->clock;
    c->next_clock = args->clock + args->sample_ticks;
    sched_add_timer(&c->timer);
}
DECL_COMMAND(command_query_counter,
             "query_counter oid=%c clock=%u poll_ticks=%u sample_ticks=%u");

static void report(struct counter *c, uint8_t oid)
{
    uint32_t next_clock, count, count_clock;
    bool is_due;

    irq_disable();
    is_due = c->is_due;
    c->is_due = false;
    next_clock = c->next_clock;
    count = c->count;
    count_clock = c->count_clock;
    irq_enable();
    if (is_due)
        sendf("counter_state oid=%c next_clock=%u count=%u count_clock=%u",
              oid, next_clock, count, count_clock);
}

void counter_task(void)
{
    struct counter *c;
    int16_t oid = -1;

    if (!sched_take(&counter_wake))
        return;
    while ((c = oid_next(&oid, &counter_kind)))
        report(c, (uint8_t)oid);
}
DECL_TASK(counter_task);
