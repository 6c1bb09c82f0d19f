/* SPDX-License-Identifier: GPL-3.0-or-later
 * Triggers on a sensor's readings. */
#include <stdbool.h>
#include <stddef.h>

#include "board/irq.h"
#include "board/timer.h"
#include "core/oid.h"
#include "core/sched.h"
#include "motion/trsync.h"
#include "sensors/sos_filter.h"
#include "sensors/trigger_analog.h"

enum { TYPE_ABS_GE, TYPE_GT, TYPE_DIFF_PEAK_GT, TYPE_COUNT };
DECL_ENUMERATION("trigger_analog_type", "abs_ge", 0);
DECL_ENUMERATION("trigger_analog_type", "gt", 1);
DECL_ENUMERATION("trigger_analog_type", "diff_peak_gt", 2);

/* Added to error_reason; a sensor's own errors come after the last. */
enum { ERROR_RAW_RANGE, ERROR_OVERFLOW, ERROR_MONITOR, ERROR_SENSOR };
DECL_ENUMERATION("trigger_analog_error:", "RAW_RANGE", 0);
DECL_ENUMERATION("trigger_analog_error:", "OVERFLOW", 1);
DECL_ENUMERATION("trigger_analog_error:", "MONITOR", 2);
DECL_ENUMERATION("trigger_analog_error:", "SENSOR_SPECIFIC", 3);

struct trigger_analog {
    struct timer monitor_timer;
    struct sos_filter *filter;
    struct trsync *ts;
    int32_t raw_min, raw_max;
    int32_t value, peak;         /* to compare with; the highest so far */
    uint32_t start_clock;        /* readings before do not count */
    uint32_t event_clock;        /* of what has triggered */
    uint32_t monitor_ticks;
    uint8_t type;
    uint8_t trigger_reason, error_reason;
    uint8_t n_silent, max_silent; /* monitor ticks without a reading */
    volatile bool is_homing;
    bool has_peak;
};

static const ROM struct oid_kind trigger_analog_kind = {
    sizeof(struct trigger_analog)
};

struct trigger_analog *trigger_analog_lookup(uint8_t oid)
{
    return oid_lookup(oid, &trigger_analog_kind);
}

/* Irqs off. */
static void stop_homing(struct trigger_analog *t, uint8_t reason)
{
    t->is_homing = false;
    trsync_trigger(t->ts, reason);
}

static void stop_with_error(struct trigger_analog *t, uint8_t error)
{
    irq_flag_t flag = irq_save();

    if (t->is_homing) {
        t->event_clock = timer_read_clock();
        stop_homing(t, (uint8_t)(t->error_reason + error));
    }
    irq_restore(flag);
}

/* A sensor that is late is as good as none while the machine moves. */
static bool monitor_event(struct timer *timer)
{
    struct trigger_analog *t = CONTAINER_OF(timer, struct trigger_analog,
                                            monitor_timer);

    if (!t->is_homing)
        return TIMER_DONE;
    if (++t->n_silent > t->max_silent) {
        stop_with_error(t, ERROR_MONITOR);
        return TIMER_DONE;
    }
    timer->waketime += t->monitor_ticks;
    return TIMER_AGAIN;
}

/* The peak is where contact was made: its clock is the one to report. */
static bool falls_from_peak(struct trigger_analog *t, int32_t value,
                            uint32_t clock)
{
    if (!t->has_peak || value > t->peak) {
        t->has_peak = true;
        t->peak = value;
        t->event_clock = clock;
    }
    return (int64_t)t->peak - value > t->value;
}

static bool is_triggered(struct trigger_analog *t, int32_t value,
                         uint32_t clock)
{
    if (t->type == TYPE_DIFF_PEAK_GT)
        return falls_from_peak(t, value, clock);
    t->event_clock = clock;
    if (t->type == TYPE_GT)
        return value > t->value;
    return (value < 0 ? -(int64_t)value : value) >= t->value;
}

static void compare(struct trigger_analog *t, int32_t value, uint32_t clock)
{
    irq_flag_t flag = irq_save();

    if (t->is_homing && is_triggered(t, value, clock))
        stop_homing(t, t->trigger_reason);
    irq_restore(flag);
}

void trigger_analog_update(struct trigger_analog *t, int32_t reading)
{
    int32_t value = reading;
    uint32_t clock;

    if (!t || !t->is_homing)
        return;
    clock = timer_read_clock();
    t->n_silent = 0;
    if (reading < t->raw_min || reading > t->raw_max) {
        stop_with_error(t, ERROR_RAW_RANGE);
        return;
    }
    if (!sos_filter_apply(t->filter, &value)) {
        stop_with_error(t, ERROR_OVERFLOW);
        return;
    }
    if (!timer_is_before(clock, t->start_clock))
        compare(t, value, clock);
}

void trigger_analog_note_error(struct trigger_analog *t, uint8_t error)
{
    if (t)
        stop_with_error(t, (uint8_t)(ERROR_SENSOR + error));
}


/* ---- Commands ---- */

void command_config_trigger_analog(
    const struct args_config_trigger_analog *args)
{
    struct sos_filter *filter = sos_filter_lookup(args->sos_filter_oid);
    struct trigger_analog *t = oid_new(args->oid, &trigger_analog_kind);

    t->monitor_timer.event = monitor_event;
    t->filter = filter;
    t->raw_min = INT32_MIN;
    t->raw_max = INT32_MAX;
}
DECL_COMMAND(command_config_trigger_analog,
             "config_trigger_analog oid=%c sos_filter_oid=%c");

void command_trigger_analog_set_raw_range(
    const struct args_trigger_analog_set_raw_range *args)
{
    struct trigger_analog *t = trigger_analog_lookup(args->oid);

    irq_disable();
    t->raw_min = args->raw_min;
    t->raw_max = args->raw_max;
    irq_enable();
}
DECL_COMMAND(command_trigger_analog_set_raw_range,
             "trigger_analog_set_raw_range oid=%c raw_min=%i raw_max=%i");

void command_trigger_analog_set_trigger(
    const struct args_trigger_analog_set_trigger *args)
{
    struct trigger_analog *t = trigger_analog_lookup(args->oid);

    if (args->trigger_analog_type >= TYPE_COUNT)
        shutdown("Invalid trigger_analog type");
    irq_disable();
    t->type = args->trigger_analog_type;
    t->value = args->trigger_value;
    irq_enable();
}
DECL_COMMAND(command_trigger_analog_set_trigger,
             "trigger_analog_set_trigger oid=%c trigger_analog_type=%c"
             " trigger_value=%i");

static void start_homing(struct trigger_analog *t, uint32_t clock)
{
    t->start_clock = t->event_clock = clock;
    t->n_silent = 0;
    t->has_peak = false;
    t->is_homing = true;
    if (!t->monitor_ticks)
        return;
    t->monitor_timer.waketime = clock + t->monitor_ticks;
    sched_add_timer(&t->monitor_timer);
}

/* trigger_reason=0 ends homing; monitor_ticks=0: any silence will do. */
void command_trigger_analog_home(const struct args_trigger_analog_home *args)
{
    struct trigger_analog *t = trigger_analog_lookup(args->oid);

    sched_del_timer(&t->monitor_timer);
    t->is_homing = false;
    if (!args->trigger_reason)
        return;
    t->ts = trsync_lookup(args->trsync_oid);
    t->trigger_reason = args->trigger_reason;
    t->error_reason = args->error_reason;
    t->monitor_ticks = args->monitor_ticks;
    t->max_silent = (uint8_t)(args->monitor_max < UINT8_MAX
                              ? args->monitor_max : UINT8_MAX - 1);
    irq_disable();
    start_homing(t, args->clock);
    irq_enable();
}
DECL_COMMAND(command_trigger_analog_home,
             "trigger_analog_home oid=%c trsync_oid=%c trigger_reason=%c"
             " error_reason=%c clock=%u monitor_ticks=%u monitor_max=%u");

void command_trigger_analog_query_state(
    const struct args_trigger_analog_query_state *args)
{
    struct trigger_analog *t = trigger_analog_lookup(args->oid);
    uint32_t event_clock;
    bool is_homing;

    irq_disable();
    is_homing = t->is_homing;
    event_clock = t->event_clock;
    irq_enable();
    sendf("trigger_analog_state oid=%c homing=%c homing_clock=%u", args->oid,
          is_homing, event_clock);
}
DECL_COMMAND(command_trigger_analog_query_state,
             "trigger_analog_query_state oid=%c");

void trigger_analog_shutdown(void)
{
    struct trigger_analog *t;
    int16_t oid = -1;

    while ((t = oid_next(&oid, &trigger_analog_kind)))
        t->is_homing = false;
}
DECL_SHUTDOWN(trigger_analog_shutdown);
