/* SPDX-License-Identifier: GPL-3.0-or-later
 * Time of PRU1.  The core has no interrupts: timers are served between tasks,
 * and while the core waits. */
#include "board/irq.h"
#include "board/timer.h"
#include "core/sched.h"
#include "exec.h"

/* A step waits for other motors' and for the command that runs. */
DECL_CONSTANT("STEP_LATENCY_TICKS", 600);

#define TICKS_PER_US (CONFIG_CLOCK_FREQ / 1000000)
#define BURST_TICKS (100 * TICKS_PER_US)
#define LATE_TICKS (1000 * TICKS_PER_US)

static uint32_t next_timer;

uint32_t timer_from_us(uint32_t us)
{
    return us * TICKS_PER_US;
}

void timer_kick(uint32_t clock)
{
    next_timer = clock;
}

/* Irqs off. */
static void serve_timers(void)
{
    uint32_t now = timer_read_clock(), burst_end = now + BURST_TICKS;

    if (timer_is_before(next_timer + LATE_TICKS, now))
        sched_shutdown_late();
    while (!timer_is_before(now, next_timer)
           && timer_is_before(now, burst_end)) {
        next_timer = sched_run_timer();
        now = timer_read_clock();
    }
}

void irq_poll(void)
{
    exec_poll();
    if (!timer_is_before(timer_read_clock(), next_timer))
        serve_timers();
}

void irq_wait(void)
{
    irq_poll();
}
