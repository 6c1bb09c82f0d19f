/* SPDX-License-Identifier: GPL-3.0-or-later
 * Commands that every firmware knows: who it is, what time it is, how busy it
 * is, and stopping. */
#include "board/irq.h"
#include "board/reset.h"
#include "board/timer.h"
#include "core/command.h"
#include "core/load.h"
#include "core/sched.h"
#include "core/tables.h"

DECL_CONSTANT_STR("MCU", CONFIG_MCU);

/* A timer reaches less than 2^31 ticks ahead. */
#define STATS_PERIOD (CONFIG_CLOCK_FREQ * (CONFIG_CLOCK_FREQ > 400000000 ? 3 : 5))
#define IDENTIFY_MAX 49

static bool stats_event(struct timer *timer);
static struct timer stats_timer = { .event = stats_event };
static struct task_wake stats_wake;
static uint32_t clock_high, clock_seen;


/* ---- Identification ---- */

void command_identify(const struct args_identify *args)
{
    uint32_t offset = args->offset, size = tables_dictionary_size;
    uint8_t count = args->count;

    if (offset > size)
        offset = size;
    if (count > IDENTIFY_MAX)
        count = IDENTIFY_MAX;
    if (count > size - offset)
        count = (uint8_t)(size - offset);
    sendf("identify_response offset=%u data=%.*s", args->offset, count,
          &tables_dictionary[offset]);
}
DECL_COMMAND_FLAGS(command_identify, COMMAND_IN_SHUTDOWN,
                   "identify offset=%u count=%c");


/* ---- Time and load ---- */

/* Count wraps of the clock; called more than once a wrap. */
static uint32_t note_clock(void)
{
    uint32_t now = timer_read_clock();

    if (now < clock_seen)
        clock_high++;
    clock_seen = now;
    return now;
}

void command_get_clock(const struct args_get_clock *args)
{
    (void)args;
    sendf("clock clock=%u", timer_read_clock());
}
DECL_COMMAND_FLAGS(command_get_clock, COMMAND_IN_SHUTDOWN, "get_clock");

void command_get_uptime(const struct args_get_uptime *args)
{
    uint32_t now = note_clock();

    (void)args;
    sendf("uptime high=%u clock=%u", clock_high, now);
}
DECL_COMMAND_FLAGS(command_get_uptime, COMMAND_IN_SHUTDOWN, "get_uptime");

static bool stats_event(struct timer *timer)
{
    sched_wake(&stats_wake);
    timer->waketime += STATS_PERIOD;
    return TIMER_AGAIN;
}

void stats_task(void)
{
    struct load_stats load;

    if (!sched_take(&stats_wake))
        return;
    note_clock();
    load_take(&load);
    sendf("stats count=%u sum=%u sumsq=%u", load.count, load.sum,
          load.sumsq);
}
DECL_TASK(stats_task);

/* At start, and after a shutdown has emptied the list of timers. */
void stats_restart(void)
{
    stats_timer.waketime = timer_read_clock() + STATS_PERIOD;
    sched_add_timer(&stats_timer);
}
DECL_INIT(stats_restart);
DECL_SHUTDOWN(stats_restart);


/* ---- Stopping ---- */

void command_emergency_stop(const struct args_emergency_stop *args)
{
    (void)args;
    shutdown("Command request");
}
DECL_COMMAND_FLAGS(command_emergency_stop, COMMAND_IN_SHUTDOWN,
                   "emergency_stop");

void command_clear_shutdown(const struct args_clear_shutdown *args)
{
    (void)args;
    sched_clear_shutdown();
}
DECL_COMMAND_FLAGS(command_clear_shutdown, COMMAND_IN_SHUTDOWN,
                   "clear_shutdown");

#if CONFIG_HAVE_RESET
void command_reset(const struct args_reset *args)
{
    (void)args;
    reset_mcu();
}
DECL_COMMAND_FLAGS(command_reset, COMMAND_IN_SHUTDOWN, "reset");
#endif
