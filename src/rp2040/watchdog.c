/* SPDX-License-Identifier: GPL-3.0-or-later
 * The watchdog: 500 ms (data sheet, 4.7).  That of an RP2040 counts two for
 * each tick of the timer's clock (erratum RP2040-E1), that of an RP2350 us. */
#include "board/watchdog.h"
#include "chip.h"
#include "core/sched.h"

#if CONFIG_MACH_RP2350
#define COUNT 500000
#else
#define COUNT (2 * (CONFIG_CLOCK_FREQ / 2))
#endif
_Static_assert(COUNT < 1 << 24, "the watchdog has 24 bits");

void watchdog_pet(void)
{
    WATCHDOG->LOAD = COUNT;
}

void watchdog_init(void)
{
#if CONFIG_MACH_RP2350
    struct tick_regs *tick = &((struct tick_regs *)TICKS_BASE)[TICKS_WATCHDOG];

    tick->CYCLES = XOSC_FREQ / 1000000;
    tick->CTRL = 1;
#endif
    PSM->WDSEL = PSM_WDSEL_ALL;
    watchdog_pet();
    RP_SET(WATCHDOG->CTRL) = WATCHDOG_CTRL_ENABLE;
}
DECL_INIT(watchdog_init);
