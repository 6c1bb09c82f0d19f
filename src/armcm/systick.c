/* SPDX-License-Identifier: GPL-3.0-or-later
 * SysTick interrupts when a timer is due.  The clock is the processor's cycle
 * counter, or one of the port's that counts the same cycles.
 *
 * SysTick reaches 2^24 cycles, a timer further ahead is approached in hops.  It
 * goes on counting after its interrupt; one that comes of that, or a hop, finds
 * nothing due and is set anew.
 */
#include "armcm/burst.h"
#include "board/irq.h"
#include "board/timer.h"
#include "core/sched.h"

/* Interrupts come this much early: what it takes to get to the events */
#define ENTRY_TICKS 32
/* An event this near is waited for */
#define NEAR_TICKS (ENTRY_TICKS + 48)
/* From here to what an event does */
#define LEAD_TICKS 16

/* Steps of other motors, inputs, outputs and bytes that come first */
DECL_CONSTANT("STEP_LATENCY_TICKS", 400);

static uint32_t target;

__attribute__((noinline))
void *armcm_seek_far(struct armcm_timer *second, uint32_t clock,
                     const void *sentinel)
{
    struct armcm_timer *other = second, *next = other->next;

    while (next != sentinel && (int32_t)(clock - next->waketime) >= 0) {
        other = next;
        next = next->next;
    }
    return other;
}

uint32_t timer_from_us(uint32_t us)
{
    return us * US_TICKS;
}

/* Interrupt after `ticks`, at most SYSTICK_MAX.  (Any value clears CVR.) */
static inline void set_alarm(uint32_t ticks)
{
    SYSTICK->RVR = ticks;
    SYSTICK->CVR = ticks;
}

/* Interrupt before `clock`, at once if that has passed. */
void timer_kick(uint32_t clock)
{
    int32_t ahead = (int32_t)(clock - timer_read_clock()) - ENTRY_TICKS;

    target = clock;
    if (ahead > (int32_t)SYSTICK_MAX)
        ahead = SYSTICK_MAX;
    set_alarm(ahead > 1 ? (uint32_t)ahead : 1);
}

/* Too much at once: let others run for a moment. */
static __attribute__((noinline)) void pause_burst(uint32_t next)
{
    if ((int32_t)(timer_read_clock() - next) > (int32_t)LATE_TICKS)
        sched_shutdown_late();
    set_alarm(PAUSE_TICKS);
}

/* What the short way through the interrupt leaves: hops, events that are near,
 * long bursts.  Returns true when `next` is due. */
static __attribute__((noinline)) bool wait_event(uint32_t next, uint32_t start)
{
    uint32_t now = timer_read_clock();

    if (now - start > BURST_TICKS) {
        target = next;
        pause_burst(next);
        return false;
    }
    if ((int32_t)(next - now) > NEAR_TICKS) {
        timer_kick(next);
        return false;
    }
    while ((int32_t)(next - now) > LEAD_TICKS)
        now = timer_read_clock();
    return true;
}

/* Most often there is one event, and the next is within reach, but not near. */
void armcm_timer_irq(void)
{
    uint32_t next = target, start = timer_read_clock(), now = start;

    for (;;) {
        int32_t ahead = (int32_t)(next - now);

        if ((ahead > LEAD_TICKS || now - start > BURST_TICKS)
            && !wait_event(next, start))
            return;
        next = sched_run_timer();
        now = timer_read_clock();
        ahead = (int32_t)(next - now);
        if ((uint32_t)(ahead - NEAR_TICKS) < SYSTICK_MAX - NEAR_TICKS) {
            target = next;
            set_alarm((uint32_t)ahead - ENTRY_TICKS);
            return;
        }
    }
}

#if CONFIG_ARMCM_CYCLE_COUNTER
void armcm_start_counter(void)
{
    DEMCR |= DEMCR_TRCENA;
#if CONFIG_ARMCM_M7
    DWT_LAR = CORESIGHT_UNLOCK;
#endif
    DWT->CYCCNT = 0;
    DWT->CTRL |= DWT_CYCCNTENA;
}
#endif

void armcm_timer_init(void)
{
    armcm_start_counter();
    armcm_connect_system(ARMCM_VECTOR_SYSTICK, armcm_timer_irq);
    timer_kick(1000);
    SYSTICK->CSR = SYSTICK_CLKSOURCE | SYSTICK_TICKINT | SYSTICK_ENABLE;
}
