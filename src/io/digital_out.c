/* SPDX-License-Identifier: GPL-3.0-or-later
 * Digital outputs: on, off, or software pwm, at scheduled times. */
#include <stdbool.h>
#include <stddef.h>

#include "board/gpio.h"
#include "board/irq.h"
#include "board/timer.h"
#include "core/oid.h"
#include "core/sched.h"
#include "io/timed_output.h"

struct digital_out {
    struct timed_output out;
    struct timer cycle_timer;
    struct gpio_out pin;
    uint32_t on_ticks, off_ticks; /* of the cycle under way */
    uint32_t cycle_ticks;         /* 0: no software pwm */
    uint8_t level, default_level;
    bool is_cycling;
};

static const ROM struct oid_kind digital_out_kind = {
    sizeof(struct digital_out)
};
static struct task_wake digital_wake;

static void set_level(struct digital_out *d, uint8_t level)
{
    d->level = level;
    gpio_write(d->pin, level);
}

static bool cycle_event(struct timer *timer)
{
    struct digital_out *d = CONTAINER_OF(timer, struct digital_out,
                                         cycle_timer);

    gpio_toggle_irq(d->pin);
    d->level = !d->level;
    timer->waketime += d->level ? d->on_ticks : d->off_ticks;
    return TIMER_AGAIN;
}

/* Irq: pulses begin now, at `clock`. */
static void start_cycle(struct digital_out *d, uint32_t on_ticks,
                        uint32_t clock)
{
    set_level(d, 1);
    d->on_ticks = on_ticks;
    d->off_ticks = d->cycle_ticks - on_ticks;
    d->is_cycling = true;
    sched_move_timer(&d->cycle_timer, clock + on_ticks);
}

/* Irqs off: on for on_ticks of each cycle, from clock. */
static bool set_output(struct digital_out *d, uint32_t on_ticks,
                       uint32_t clock)
{
    if (on_ticks && on_ticks < d->cycle_ticks) {
        start_cycle(d, on_ticks, clock);
        return false;
    }
    if (d->is_cycling)
        sched_del_timer(&d->cycle_timer);
    d->is_cycling = false;
    set_level(d, on_ticks != 0);
    return d->level == d->default_level;
}

static bool apply_value(struct timed_output *out, uint32_t value,
                        uint32_t clock)
{
    return set_output(CONTAINER_OF(out, struct digital_out, out), value,
                      clock);
}

static void rest(struct timed_output *out)
{
    struct digital_out *d = CONTAINER_OF(out, struct digital_out, out);

    set_output(d, d->default_level ? UINT32_MAX : 0, 0);
}

static const struct timed_output_kind digital_timed_kind = {
    .apply = apply_value,
    .rest = rest,
    .wake = &digital_wake,
    .missed = DECL_STRING_ID("Missed scheduling of next digital out event"),
    .exceeds = DECL_STRING_ID(
        "Scheduled digital out event will exceed max_duration"),
};

void command_config_digital_out(const struct args_config_digital_out *args)
{
    struct gpio_out pin = gpio_setup_output(args->pin, args->value != 0);
    struct digital_out *d = oid_new(args->oid, &digital_out_kind);

    d->level = args->value != 0;
    d->default_level = args->default_value != 0;
    d->pin = pin;
    d->cycle_timer.event = cycle_event;
    timed_output_setup(&d->out, &digital_timed_kind, args->max_duration);
    timed_output_start(&d->out, d->level == d->default_level);
}
DECL_COMMAND(command_config_digital_out,
             "config_digital_out oid=%c pin=%u value=%c default_value=%c"
             " max_duration=%u");

void command_set_digital_out_pwm_cycle(
    const struct args_set_digital_out_pwm_cycle *args)
{
    struct digital_out *d = oid_lookup(args->oid, &digital_out_kind);

    irq_disable();
    if (timed_output_is_pending(&d->out) || d->is_cycling)
        shutdown("Can not set soft pwm cycle ticks while updates pending");
    d->cycle_ticks = args->cycle_ticks;
    irq_enable();
}
DECL_COMMAND(command_set_digital_out_pwm_cycle,
             "set_digital_out_pwm_cycle oid=%c cycle_ticks=%u");

void command_queue_digital_out(const struct args_queue_digital_out *args)
{
    struct digital_out *d = oid_lookup(args->oid, &digital_out_kind);

    timed_output_queue(&d->out, args->clock, args->on_ticks);
}
DECL_COMMAND(command_queue_digital_out,
             "queue_digital_out oid=%c clock=%u on_ticks=%u");

/* At once, for outputs that are not scheduled. */
void command_update_digital_out(const struct args_update_digital_out *args)
{
    struct digital_out *d = oid_lookup(args->oid, &digital_out_kind);
    irq_flag_t flag = sched_lock_events();
    bool is_default;

    if (timed_output_is_pending(&d->out))
        shutdown("update_digital_out not valid with active queue");
    is_default = set_output(d, args->value ? UINT32_MAX : 0,
                            timer_read_clock());
    timed_output_start(&d->out, is_default);
    sched_unlock_events(flag);
}
DECL_COMMAND(command_update_digital_out, "update_digital_out oid=%c value=%c");

/* A pin that needs no object. */
void command_set_digital_out(const struct args_set_digital_out *args)
{
    gpio_setup_output(args->pin, args->value != 0);
}
DECL_COMMAND(command_set_digital_out, "set_digital_out pin=%u value=%c");

#if TIMED_OUTPUT_REST
/* From now on it does not shut the mcu down when max_duration is over. */
void command_rest_digital_out(const struct args_rest_digital_out *args)
{
    struct digital_out *d = oid_lookup(args->oid, &digital_out_kind);

    d->out.is_resting = true;
}
DECL_COMMAND(command_rest_digital_out, "rest_digital_out oid=%c");

void digital_out_task(void)
{
    struct digital_out *d;
    int16_t oid = -1;

    if (!sched_take(&digital_wake))
        return;
    while ((d = oid_next(&oid, &digital_out_kind)))
        if (timed_output_take_expired(&d->out))
            sendf("output_expired oid=%c", (uint8_t)oid);
}
DECL_TASK(digital_out_task);
#endif

void digital_out_shutdown(void)
{
    struct digital_out *d;
    int16_t oid = -1;

    while ((d = oid_next(&oid, &digital_out_kind))) {
        timed_output_clear(&d->out);
        d->is_cycling = false;
        set_level(d, d->default_level);
    }
}
DECL_SHUTDOWN(digital_out_shutdown);
