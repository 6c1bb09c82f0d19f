/* SPDX-License-Identifier: GPL-3.0-or-later
 * Time and interrupts of a linux process.
 *
 * There is one thread.  Timers are served whenever interrupts become enabled,
 * between tasks, and while the process waits.  Waiting sleeps a little short of
 * the next timer, by what the last sleeps were too long, and spins the rest.
 */
#include <time.h>

#include "board/irq.h"
#include "board/timer.h"
#include "core/sched.h"
#include "process.h"

#define NS_PER_S 1000000000
#define NS_PER_TICK (NS_PER_S / CONFIG_CLOCK_FREQ)
#define TICKS_PER_US (CONFIG_CLOCK_FREQ / 1000000)
#define BURST_TICKS (100 * TICKS_PER_US)
#define POLL_TICKS (1000 * TICKS_PER_US)
#define SPIN_MAX_NS 50000
#define LATE_MAX_MS 100
#define STEP_LATE_MAX_US 1000

_Static_assert(NS_PER_TICK * CONFIG_CLOCK_FREQ == NS_PER_S,
               "a tick must be a whole number of nanoseconds");

uint32_t clock_max_step_lag_us = STEP_LATE_MAX_US;

static uint64_t start_ns;
static uint64_t next_timer;  /* clock, 64 bits */
static uint64_t next_poll;   /* look at the console then, however busy */
static uint64_t max_late = (uint64_t)LATE_MAX_MS * 1000 * TICKS_PER_US;
static int64_t oversleep_ns; /* of the last sleeps */
static volatile bool irqs_off;


/* ---- Clock ---- */

static uint64_t read_ns(void)
{
    struct timespec ts;

    clock_gettime(CLOCK_MONOTONIC, &ts);
    return (uint64_t)ts.tv_sec * NS_PER_S + (uint64_t)ts.tv_nsec;
}

void clock_start(void)
{
    start_ns = read_ns();
    if (!process_options.max_late_ms)
        return;
    clock_max_step_lag_us = process_options.max_late_ms * 1000;
    max_late = (uint64_t)clock_max_step_lag_us * TICKS_PER_US;
}

uint64_t clock_start_ns(void)
{
    return start_ns;
}

uint64_t clock_read(void)
{
    return (read_ns() - start_ns) / NS_PER_TICK;
}

uint32_t timer_read_clock(void)
{
    return (uint32_t)clock_read();
}

uint32_t timer_from_us(uint32_t us)
{
    return us * TICKS_PER_US;
}


/* ---- Timers ---- */

/* The 64 bit clock nearest to `near` that ends in these 32 bits. */
static uint64_t extend(uint32_t clock, uint64_t near)
{
    return near + (uint64_t)(int64_t)(int32_t)(clock - (uint32_t)near);
}

void timer_kick(uint32_t clock)
{
    next_timer = extend(clock, clock_read());
}

/* Irqs off.  A process that was held up, or has more to do than it can, finds
 * out here. */
static void serve_timers(void)
{
    uint64_t now = clock_read(), burst_end = now + BURST_TICKS;

    if (now > next_timer + max_late)
        sched_shutdown_late();
    while (now >= next_timer && now < burst_end) {
        uint64_t ran = next_timer;
        uint32_t next = sched_run_timer();
        next_timer = extend(next, ran);
        now = clock_read();
    }
}


/* ---- Interrupts ---- */

void irq_disable(void)
{
    irqs_off = true;
    __asm__ volatile("" ::: "memory");
}

void irq_enable(void)
{
    __asm__ volatile("" ::: "memory");
    irqs_off = true;
    if (clock_read() >= next_timer)
        serve_timers();
    irqs_off = false;
}

irq_flag_t irq_save(void)
{
    irq_flag_t was_off = irqs_off;

    irq_disable();
    return was_off;
}

void irq_restore(irq_flag_t was_off)
{
    if (!was_off)
        irq_enable();
}

void irq_poll(void)
{
    uint64_t now = clock_read();

    if (now >= next_timer) {
        irq_disable();
        irq_enable();
    }
    process_poll();
    console_flush();
    if (now < next_poll)
        return;
    next_poll = now + POLL_TICKS;
    console_wait(0);
}

/* Follow rises at once and falls slowly. */
static void learn_oversleep(int64_t late_ns)
{
    if (late_ns > SPIN_MAX_NS)
        late_ns = SPIN_MAX_NS;
    if (late_ns > oversleep_ns)
        oversleep_ns = late_ns;
    else
        oversleep_ns -= (oversleep_ns - late_ns) / 16;
}

/* Sleep almost until the timer; false if something else came first. */
static bool sleep_until(uint64_t due_ns)
{
    int64_t sleep_ns = (int64_t)(due_ns - read_ns()) - oversleep_ns;
    uint64_t wake_ns = due_ns - (uint64_t)oversleep_ns;
    bool is_time = console_wait(sleep_ns > 0 ? sleep_ns : 0);

    if (is_time && sleep_ns > 0)
        learn_oversleep((int64_t)(read_ns() - wake_ns));
    return is_time;
}

void irq_wait(void)
{
    console_flush();
    if (!sleep_until(start_ns + next_timer * NS_PER_TICK))
        return;
    while (clock_read() < next_timer)
        __asm__ volatile("" ::: "memory");
    serve_timers();
}
