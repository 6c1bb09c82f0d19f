/* SPDX-License-Identifier: GPL-3.0-or-later
 * SysTick interrupts when a timer is due.  The clock is the processor's cycle
 * counter, or one of the port's that counts the same cycles.
 *
 * SysTick reaches 2^24 cycles, a timer further ahead is approached in hops.  It
 * goes on counting after its interrupt; one that comes of that, or a hop, finds
 * nothing due and is set anew.
 */
#include "armcm/alarm.h"
#include "board/irq.h"
#include "board/timer.h"
#include "core/decl.h"

/* Steps of other motors, inputs, outputs and bytes that come first */
DECL_CONSTANT("STEP_LATENCY_TICKS", 400);

/* Interrupt before `clock`, at once if that has passed. */
void timer_kick(uint32_t clock)
{
    int32_t ahead = (int32_t)(clock - timer_read_clock());

    if (ahead > (int32_t)SYSTICK_MAX)
        ahead = SYSTICK_MAX;
    if (ahead <= ENTRY_TICKS)
        ahead = ENTRY_TICKS + 1;
    alarm_set(clock, (uint32_t)ahead);
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
