/* SPDX-License-Identifier: GPL-3.0-or-later
 * Endstop switches: sampled while homing, reported to a trigger. */
#include <stdbool.h>
#include <stddef.h>

#include "board/gpio.h"
#include "board/irq.h"
#include "board/timer.h"
#include "core/oid.h"
#include "core/sched.h"
#include "motion/trsync.h"

struct endstop {
    struct timer timer;
    struct gpio_in pin;
    uint8_t pin_value;   /* level that means pressed */
    uint8_t n_left;      /* samples in a row still to be seen; 0: not homing */
    uint8_t n_samples;
    uint8_t reason;
    struct trsync *ts;
    uint32_t sample_ticks, rest_ticks;
    uint32_t next_clock; /* next sample of the slow rhythm */
};

static const ROM struct oid_kind endstop_kind = { sizeof(struct endstop) };

static bool rest_event(struct timer *timer);

/* The level must hold for all samples, else it was noise. */
static bool confirm_event(struct timer *timer)
{
    struct endstop *e = CONTAINER_OF(timer, struct endstop, timer);

    if (gpio_read(e->pin) != e->pin_value) {
        timer->event = rest_event;
        timer->waketime = e->next_clock;
        e->n_left = e->n_samples;
        return TIMER_AGAIN;
    }
    if (--e->n_left) {
        timer->waketime += e->sample_ticks;
        return TIMER_AGAIN;
    }
    trsync_trigger(e->ts, e->reason);
    return TIMER_DONE;
}

/* The slow rhythm, until the level is right for the first time. */
static bool rest_event(struct timer *timer)
{
    struct endstop *e = CONTAINER_OF(timer, struct endstop, timer);
    uint32_t next = timer->waketime + e->rest_ticks;

    e->next_clock = next;
    if (gpio_read(e->pin) != e->pin_value) {
        timer->waketime = next;
        return TIMER_AGAIN;
    }
    timer->event = confirm_event;
    return confirm_event(timer);
}

void command_config_endstop(const struct args_config_endstop *args)
{
    struct gpio_in pin = gpio_setup_input(args->pin, (int8_t)args->pull_up);
    struct endstop *e = oid_new(args->oid, &endstop_kind);

    e->pin = pin;
}
DECL_COMMAND(command_config_endstop, "config_endstop oid=%c pin=%c pull_up=%c");

static void start_homing(struct endstop *e, uint32_t clock)
{
    e->timer.waketime = e->next_clock = clock;
    e->timer.event = rest_event;
    e->n_left = e->n_samples;
    sched_add_timer(&e->timer);
}

/* sample_count=0 ends homing. */
void command_endstop_home(const struct args_endstop_home *args)
{
    struct endstop *e = oid_lookup(args->oid, &endstop_kind);

    sched_del_timer(&e->timer);
    e->n_left = 0;
    if (!args->sample_count)
        return;
    e->sample_ticks = args->sample_ticks;
    e->rest_ticks = args->rest_ticks;
    e->n_samples = args->sample_count;
    e->pin_value = args->pin_value != 0;
    e->ts = trsync_lookup(args->trsync_oid);
    e->reason = args->trigger_reason;
    start_homing(e, args->clock);
}
DECL_COMMAND(command_endstop_home,
             "endstop_home oid=%c clock=%u sample_ticks=%u sample_count=%c"
             " rest_ticks=%u pin_value=%c trsync_oid=%c trigger_reason=%c");

void command_endstop_query_state(const struct args_endstop_query_state *args)
{
    struct endstop *e = oid_lookup(args->oid, &endstop_kind);
    uint8_t is_homing;
    uint32_t next_clock;

    irq_disable();
    is_homing = e->n_left != 0;
    next_clock = e->next_clock;
    irq_enable();
    sendf("endstop_state oid=%c homing=%c next_clock=%u pin_value=%c",
          args->oid, is_homing, next_clock, gpio_read(e->pin));
}
DECL_COMMAND(command_endstop_query_state, "endstop_query_state oid=%c");

void endstop_shutdown(void)
{
    struct endstop *e;
    int16_t oid = -1;

    while ((e = oid_next(&oid, &endstop_kind)))
        e->n_left = 0;
}
DECL_SHUTDOWN(endstop_shutdown);
