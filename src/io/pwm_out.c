/* SPDX-License-Identifier: GPL-3.0-or-later
 * Hardware pwm outputs at scheduled times. */
#include <stdbool.h>
#include <stddef.h>

#include "board/pwm.h"
#include "core/oid.h"
#include "core/sched.h"
#include "io/timed_output.h"

struct pwm_out {
    struct timed_output out;
    struct gpio_pwm pin;
    uint16_t default_value;
};

static const ROM struct oid_kind pwm_out_kind = { sizeof(struct pwm_out) };
static struct task_wake pwm_wake;

static bool apply_value(struct timed_output *out, uint32_t value,
                        uint32_t clock)
{
    struct pwm_out *p = CONTAINER_OF(out, struct pwm_out, out);

    (void)clock;
    pwm_write(p->pin, (uint16_t)value);
    return value == p->default_value;
}

static void rest(struct timed_output *out)
{
    struct pwm_out *p = CONTAINER_OF(out, struct pwm_out, out);

    pwm_write(p->pin, p->default_value);
}

static const struct timed_output_kind pwm_timed_kind = {
    .apply = apply_value,
    .rest = rest,
    .wake = &pwm_wake,
    .missed = DECL_STRING_ID("Missed scheduling of next hard pwm event"),
    .exceeds = DECL_STRING_ID("Scheduled pwm event will exceed max_duration"),
};

void command_config_pwm_out(const struct args_config_pwm_out *args)
{
    struct gpio_pwm pin = pwm_setup(args->pin, args->cycle_ticks, args->value);
    struct pwm_out *p = oid_new(args->oid, &pwm_out_kind);

    p->pin = pin;
    p->default_value = args->default_value;
    timed_output_setup(&p->out, &pwm_timed_kind, args->max_duration);
    timed_output_start(&p->out, args->value == args->default_value);
}
DECL_COMMAND(command_config_pwm_out,
             "config_pwm_out oid=%c pin=%u cycle_ticks=%u value=%hu"
             " default_value=%hu max_duration=%u");

void command_queue_pwm_out(const struct args_queue_pwm_out *args)
{
    struct pwm_out *p = oid_lookup(args->oid, &pwm_out_kind);

    timed_output_queue(&p->out, args->clock, args->value);
}
DECL_COMMAND(command_queue_pwm_out, "queue_pwm_out oid=%c clock=%u value=%hu");

/* A pin that needs no object. */
void command_set_pwm_out(const struct args_set_pwm_out *args)
{
    pwm_setup(args->pin, args->cycle_ticks, args->value);
}
DECL_COMMAND(command_set_pwm_out,
             "set_pwm_out pin=%u cycle_ticks=%u value=%hu");

#if TIMED_OUTPUT_REST
/* From now on it does not shut the mcu down when max_duration is over. */
void command_rest_pwm_out(const struct args_rest_pwm_out *args)
{
    struct pwm_out *p = oid_lookup(args->oid, &pwm_out_kind);

    p->out.is_resting = true;
}
DECL_COMMAND(command_rest_pwm_out, "rest_pwm_out oid=%c");

void pwm_out_task(void)
{
    struct pwm_out *p;
    int16_t oid = -1;

    if (!sched_take(&pwm_wake))
        return;
    while ((p = oid_next(&oid, &pwm_out_kind)))
        if (timed_output_take_expired(&p->out))
            sendf("output_expired oid=%c", (uint8_t)oid);
}
DECL_TASK(pwm_out_task);
#endif

void pwm_out_shutdown(void)
{
    struct pwm_out *p;
    int16_t oid = -1;

    while ((p = oid_next(&oid, &pwm_out_kind))) {
        timed_output_clear(&p->out);
        pwm_write(p->pin, p->default_value);
    }
}
DECL_SHUTDOWN(pwm_out_shutdown);
