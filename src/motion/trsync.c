/* SPDX-License-Identifier: GPL-3.0-or-later
 * Triggers: one event stops many things. */
#include <stdbool.h>
#include <stddef.h>

#include "board/irq.h"
#include "board/timer.h"
#include "core/oid.h"
#include "core/sched.h"
#include "motion/trsync.h"

enum { IS_ARMED = 1, NEEDS_REPORT = 2 };

struct trsync {
    struct timer report_timer, expire_timer;
    uint32_t report_ticks;
    struct trsync_signal *signals;
    uint8_t flags, reason, expire_reason;
};

static const ROM struct oid_kind trsync_kind = { sizeof(struct trsync) };
static struct task_wake trsync_wake;

/* Irqs off. */
static void fire(struct trsync *ts, uint8_t reason)
{
    if (!(ts->flags & IS_ARMED))
        return;
    ts->flags &= (uint8_t)~IS_ARMED;
    ts->reason = reason;
    while (ts->signals) {
        struct trsync_signal *signal = ts->signals;
        void (*on_trigger)(struct trsync_signal *, uint8_t);
        on_trigger = signal->on_trigger;
        ts->signals = signal->next;
        signal->on_trigger = NULL;
        on_trigger(signal, reason);
    }
}

void trsync_trigger(struct trsync *ts, uint8_t reason)
{
    irq_flag_t flag = irq_save();

    if (ts->flags & IS_ARMED) {
        fire(ts, reason);
        ts->flags |= NEEDS_REPORT;
        sched_wake(&trsync_wake);
    }
    irq_restore(flag);
}

static bool report_event(struct timer *timer)
{
    struct trsync *ts = CONTAINER_OF(timer, struct trsync, report_timer);

    if (!(ts->flags & IS_ARMED))
        return TIMER_DONE;
    ts->flags |= NEEDS_REPORT;
    sched_wake(&trsync_wake);
    timer->waketime += ts->report_ticks;
    return TIMER_AGAIN;
}

static bool expire_event(struct timer *timer)
{
    struct trsync *ts = CONTAINER_OF(timer, struct trsync, expire_timer);

    trsync_trigger(ts, ts->expire_reason);
    return TIMER_DONE;
}

struct trsync *trsync_lookup(uint8_t oid)
{
    return oid_lookup(oid, &trsync_kind);
}

void trsync_add_signal(struct trsync *ts, struct trsync_signal *signal,
                       void (*on_trigger)(struct trsync_signal *, uint8_t))
{
    irq_flag_t flag = irq_save();

    if (signal->on_trigger)
        shutdown("Can't add signal that is already active");
    if (ts->flags & IS_ARMED) {
        signal->on_trigger = on_trigger;
        signal->next = ts->signals;
        ts->signals = signal;
    } else {
        on_trigger(signal, ts->reason);
    }
    irq_restore(flag);
}

void command_config_trsync(const struct args_config_trsync *args)
{
    struct trsync *ts = oid_new(args->oid, &trsync_kind);

    ts->report_timer.event = report_event;
    ts->expire_timer.event = expire_event;
}
DECL_COMMAND(command_config_trsync, "config_trsync oid=%c");

/* Forget the signals of an earlier use, without running them. */
static void drop_signals(struct trsync *ts)
{
    struct trsync_signal *signal;

    for (signal = ts->signals; signal; signal = signal->next)
        signal->on_trigger = NULL;
    ts->signals = NULL;
}

void command_trsync_start(const struct args_trsync_start *args)
{
    struct trsync *ts = trsync_lookup(args->oid);
    irq_flag_t flag = irq_save();

    drop_signals(ts);
    sched_del_timer(&ts->report_timer);
    sched_del_timer(&ts->expire_timer);
    ts->flags = IS_ARMED;
    ts->reason = 0;
    ts->expire_reason = args->expire_reason;
    ts->report_ticks = args->report_ticks;
    ts->report_timer.waketime = args->report_clock;
    if (ts->report_ticks)
        sched_add_timer(&ts->report_timer);
    irq_restore(flag);
}
DECL_COMMAND(command_trsync_start,
             "trsync_start oid=%c report_clock=%u report_ticks=%u"
             " expire_reason=%c");

void command_trsync_set_timeout(const struct args_trsync_set_timeout *args)
{
    struct trsync *ts = trsync_lookup(args->oid);
    irq_flag_t flag;

    sched_del_timer(&ts->expire_timer);
    ts->expire_timer.waketime = args->clock;
    flag = sched_lock_events();
    if (ts->flags & IS_ARMED)
        sched_add_timer(&ts->expire_timer);
    sched_unlock_events(flag);
}
DECL_COMMAND(command_trsync_set_timeout, "trsync_set_timeout oid=%c clock=%u");

/* `clock` is that of a regular report while armed, 0 in a final one. */
static void send_state(uint8_t oid, bool is_armed, uint8_t reason)
{
    sendf("trsync_state oid=%c can_trigger=%c trigger_reason=%c clock=%u",
          oid, is_armed, reason, is_armed ? timer_read_clock() : 0);
}

/* Whoever triggered first: the answer tells the reason that counts. */
void command_trsync_trigger(const struct args_trsync_trigger *args)
{
    struct trsync *ts = trsync_lookup(args->oid);

    irq_disable();
    fire(ts, args->reason);
    sched_del_timer(&ts->report_timer);
    sched_del_timer(&ts->expire_timer);
    ts->flags = 0;
    irq_enable();
    send_state(args->oid, false, ts->reason);
}
DECL_COMMAND(command_trsync_trigger, "trsync_trigger oid=%c reason=%c");

void trsync_task(void)
{
    struct trsync *ts;
    int16_t oid = -1;

    if (!sched_take(&trsync_wake))
        return;
    while ((ts = oid_next(&oid, &trsync_kind))) {
        uint8_t flags, reason;
        irq_disable();
        flags = ts->flags;
        reason = ts->reason;
        ts->flags &= (uint8_t)~NEEDS_REPORT;
        irq_enable();
        if (flags & NEEDS_REPORT)
            send_state((uint8_t)oid, flags & IS_ARMED, reason);
    }
}
DECL_TASK(trsync_task);

void trsync_shutdown(void)
{
    struct trsync *ts;
    int16_t oid = -1;

    while ((ts = oid_next(&oid, &trsync_kind))) {
        drop_signals(ts);
        ts->flags = 0;
    }
}
DECL_SHUTDOWN(trsync_shutdown);
