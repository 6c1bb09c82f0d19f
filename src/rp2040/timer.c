/* SPDX-License-Identifier: GPL-3.0-or-later
 * The clock of timers: that of the crystal, 12 MHz, ten cycles of the processor
 * a tick.  An alarm interrupts before an event is due (data sheet, 4.6).
 */
#include "armcm/alarm.h"
#include "board/irq.h"
#include "board/timer.h"
#include "chip.h"
#include "core/decl.h"

/* Steps of other motors, inputs, outputs and bytes that come first */
DECL_CONSTANT("STEP_LATENCY_TICKS", 40);

/* An alarm goes off at its very tick: one that may have passed is forced. */
void timer_kick(uint32_t clock)
{
    alarm_set(clock, 0);
    if ((int32_t)(clock - ENTRY_TICKS - timer_read_clock()) <= 0)
        TIMER->INTF = 1;
}

/* One cycle of the crystal is one tick (data sheet, 4.7.2). */
void armcm_timer_init(void)
{
    WATCHDOG->TICK = WATCHDOG_TICK_ENABLE | XOSC_FREQ / CONFIG_CLOCK_FREQ;
    chip_enable(RESET_TIMER);
    SYSTICK->RVR = SYSTICK_MAX;
    SYSTICK->CVR = 0;
    SYSTICK->CSR = SYSTICK_CLKSOURCE | SYSTICK_ENABLE;
    armcm_connect(TIMER_IRQ, armcm_timer_irq);
    TIMER->INTE = 1;
    timer_kick(timer_read_clock() + 1000);
}
