/* SPDX-License-Identifier: GPL-3.0-or-later
 * Time and interrupts of the simulated mcu.
 *
 * Work takes no time: a timer event happens at exactly its clock.  Whoever
 * waits by reading the clock over and over makes it move: in an event (or
 * with irqs off) the skew grows, which delays what follows; a task lets the
 * world go on, with interrupts served as they come.
 */
#include <stddef.h>

#include "board/irq.h"
#include "board/timer.h"
#include "core/sched.h"
#include "world.h"

enum { FREE_READS = 64, WAIT_TICKS = 16 };
#define LATE_LIMIT (CONFIG_CLOCK_FREQ / 1000)

struct simulator simulator;

uint64_t simulator_clock(void)
{
    return simulator.now + simulator.skew;
}

static void set_now(uint64_t clock)
{
    simulator.now = clock;
    simulator.skew = 0;
    simulator.n_reads = 0;
}

static void absorb_skew(void)
{
    if (simulator.skew)
        set_now(simulator_clock());
}

static int32_t ticks_to_timer(void)
{
    return (int32_t)(simulator.timer - (uint32_t)simulator.now);
}

uint64_t simulator_next_event(void)
{
    int32_t ticks = ticks_to_timer();
    uint64_t next = simulator.now + (uint64_t)(ticks > 0 ? ticks : 0);

    if (simulator.wake_at && simulator.wake_at < next)
        next = simulator.wake_at;
    return next > simulator.until ? next : simulator.until + 1;
}

/* Run the first timer, at its time or late. */
static void run_event(int32_t ticks)
{
    irq_flag_t was_off;

    if (ticks > 0) {
        set_now(simulator.now + (uint32_t)ticks);
    } else if (ticks < 0) {
        simulator.host->late(simulator.host->ctx, simulator.now,
                             (uint64_t)-(int64_t)ticks);
        if (-(int64_t)ticks > LATE_LIMIT)
            sched_shutdown_late();
    }
    was_off = irq_save();
    simulator.timer = sched_run_timer();
    irq_restore(was_off);
    absorb_skew();
}

/* Returns false when the first timer lies beyond `limit`. */
static bool run_due(uint64_t limit)
{
    int32_t ticks = ticks_to_timer();

    if (ticks > 0 && simulator.now + (uint32_t)ticks > limit)
        return false;
    run_event(ticks);
    return true;
}

void irq_wait(void)
{
    absorb_skew();
    simulator.n_reads = 0;
    if (simulator.now <= simulator.until && run_due(simulator.until))
        return;
    if (simulator.now < simulator.until)
        set_now(simulator.until);
    coroutine_leave();
}

/* A task waits: serve interrupts and the world until `target`. */
static void wait_in_task(uint64_t target)
{
    absorb_skew();
    while (simulator.now < target) {
        if (run_due(target < simulator.until ? target : simulator.until))
            continue;
        if (target <= simulator.until) {
            simulator.now = target;
            break;
        }
        if (simulator.now < simulator.until)
            set_now(simulator.until);
        simulator.wake_at = target;
        coroutine_leave();
        simulator.wake_at = 0;
    }
}

uint32_t timer_read_clock(void)
{
    if (++simulator.n_reads > FREE_READS) {
        if (simulator.irqs_off)
            simulator.skew += WAIT_TICKS;
        else
            wait_in_task(simulator_clock() + WAIT_TICKS);
    }
    return (uint32_t)simulator_clock();
}

void simulator_delay(uint32_t ticks)
{
    if (simulator.irqs_off)
        simulator.skew += ticks;
    else
        wait_in_task(simulator_clock() + ticks);
}

uint32_t timer_from_us(uint32_t us)
{
    return us * (CONFIG_CLOCK_FREQ / 1000000);
}

void timer_kick(uint32_t clock)
{
    simulator.timer = clock;
}

void irq_disable(void)
{
    simulator.irqs_off = true;
}

void irq_enable(void)
{
    simulator.irqs_off = false;
}

irq_flag_t irq_save(void)
{
    irq_flag_t flag = simulator.irqs_off;

    simulator.irqs_off = true;
    return flag;
}

void irq_restore(irq_flag_t flag)
{
    simulator.irqs_off = flag;
}

void irq_poll(void)
{
}
