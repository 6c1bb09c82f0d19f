/* SPDX-License-Identifier: GPL-3.0-or-later
 * Analog inputs: oversampled, range checked, reported in batches.
 *
 * A reading is the sum of n_samples conversions.  It starts every rest_ticks;
 * readings collect until a report is full.
 */
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "board/adc.h"
#include "board/timer.h"
#include "board/irq.h"
#include "core/oid.h"
#include "core/sched.h"
#include "sensors/trigger_analog.h"

enum { REPORT_MAX = 48, READING_SIZE = 2 };

struct analog_in {
    struct timer timer;
    uint32_t sample_ticks, rest_ticks;
    uint32_t next_clock; /* start of the next reading */
    uint16_t sum, min, max;
    struct gpio_adc pin;
    struct trigger_analog *trigger; /* may be NULL */
    uint8_t n_samples, n_left; /* conversions of a reading; still to do */
    uint8_t n_bad, bad_limit;  /* readings in a row that were out of range */
    uint8_t report_size, n_bytes;
    uint8_t data[REPORT_MAX];
};

static const ROM struct oid_kind analog_in_kind = { sizeof(struct analog_in) };
static struct task_wake analog_wake;

static void check_range(struct analog_in *a)
{
    if (a->sum >= a->min && a->sum <= a->max) {
        a->n_bad = 0;
    } else if (++a->n_bad >= a->bad_limit) {
        try_shutdown("ADC out of range");
    }
}

/* Drops the reading if the task has not yet taken a full report. */
static void store_reading(struct analog_in *a)
{
    uint8_t n = a->n_bytes;

    if (n >= a->report_size)
        return;
    a->data[n++] = (uint8_t)a->sum;
    a->data[n++] = (uint8_t)(a->sum >> 8);
    a->n_bytes = n;
    if (n == a->report_size)
        sched_wake(&analog_wake);
}

/* All samples of a reading are there. */
static void finish_reading(struct analog_in *a)
{
    a->next_clock += a->rest_ticks;
    check_range(a);
    if (a->trigger)
        trigger_analog_update(a->trigger, a->sum);
    store_reading(a);
    a->sum = 0;
    a->n_left = a->n_samples;
}

static bool sample_event(struct timer *timer)
{
    struct analog_in *a = CONTAINER_OF(timer, struct analog_in, timer);
    uint32_t delay = adc_sample(a->pin);

    if (delay) {
        timer->waketime += delay;
        return TIMER_AGAIN;
    }
    a->sum = (uint16_t)(a->sum + adc_read(a->pin));
    if (--a->n_left) {
        timer->waketime += a->sample_ticks;
        return TIMER_AGAIN;
    }
    finish_reading(a);
    timer->waketime = a->next_clock;
    return TIMER_AGAIN;
}

void command_config_analog_in(const struct args_config_analog_in *args)
{
    struct gpio_adc pin = adc_setup(args->pin);
    struct analog_in *a = oid_new(args->oid, &analog_in_kind);

    a->pin = pin;
    a->timer.event = sample_event;
}
DECL_COMMAND(command_config_analog_in, "config_analog_in oid=%c pin=%u");

static void stop(struct analog_in *a)
{
    adc_cancel(a->pin);
    a->sum = 0;
    a->n_left = a->n_bytes = a->n_bad = 0;
}

/* sample_count=0 stops. */
void command_query_analog_in(const struct args_query_analog_in *args)
{
    struct analog_in *a = oid_lookup(args->oid, &analog_in_kind);

    if (args->bytes_per_report % READING_SIZE
        || args->bytes_per_report > REPORT_MAX
        || (args->sample_count && !args->bytes_per_report))
        shutdown("Invalid analog_in bytes_per_report");
    sched_del_timer(&a->timer);
    stop(a);
    if (!args->sample_count)
        return;
    a->next_clock = a->timer.waketime = args->clock;
    a->sample_ticks = args->sample_ticks;
    a->rest_ticks = args->rest_ticks;
    a->n_samples = a->n_left = args->sample_count;
    a->report_size = args->bytes_per_report;
    a->min = args->min_value;
    a->max = args->max_value;
    a->bad_limit = args->range_check_count;
    sched_add_timer(&a->timer);
}
DECL_COMMAND(command_query_analog_in,
             "query_analog_in oid=%c clock=%u sample_ticks=%u sample_count=%c"
             " rest_ticks=%u bytes_per_report=%c min_value=%hu max_value=%hu"
             " range_check_count=%c");

#if CONFIG_WANT_TRIGGER_ANALOG
void command_analog_in_attach_trigger_analog(
    const struct args_analog_in_attach_trigger_analog *args)
{
    struct analog_in *a = oid_lookup(args->oid, &analog_in_kind);

    a->trigger = trigger_analog_lookup(args->trigger_analog_oid);
}
DECL_COMMAND(command_analog_in_attach_trigger_analog,
             "analog_in_attach_trigger_analog oid=%c trigger_analog_oid=%c");
#endif

static void report(struct analog_in *a, uint8_t oid)
{
    uint8_t data[REPORT_MAX], size;
    uint32_t next_clock;

    irq_disable();
    size = a->n_bytes;
    if (!size || size < a->report_size) {
        irq_enable();
        return;
    }
    memcpy(data, a->data, size);
    next_clock = a->next_clock;
    a->n_bytes = 0;
    irq_enable();
    sendf("analog_in_state oid=%c next_clock=%u values=%*s", oid, next_clock,
          size, data);
}

void analog_in_task(void)
{
    struct analog_in *a;
    int16_t oid = -1;

    if (!sched_take(&analog_wake))
        return;
    while ((a = oid_next(&oid, &analog_in_kind)))
        report(a, (uint8_t)oid);
}
DECL_TASK(analog_in_task);

void analog_in_shutdown(void)
{
    struct analog_in *a;
    int16_t oid = -1;

    while ((a = oid_next(&oid, &analog_in_kind)))
        stop(a);
}
DECL_SHUTDOWN(analog_in_shutdown);
