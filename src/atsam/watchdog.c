/* SPDX-License-Identifier: GPL-3.0-or-later
 * The watchdog: 500 ms of the slow clock of about 32 kHz (11057, 15.4).  It
 * runs since reset, with 16 s; its mode can be written once. */
#include "board/watchdog.h"
#include "chip.h"
#include "core/sched.h"

#define REGS ((struct wdt_regs *)WDT_BASE)
#define RELOAD (32768u / 128 / 2)

void watchdog_pet(void)
{
    REGS->CR = WDT_CR_RESTART;
}

void watchdog_init(void)
{
#ifdef RSWDT_BASE
    /* the second one: all ones are what its reserved bits want */
    ((struct wdt_regs *)RSWDT_BASE)->MR = WDT_MR_WDDIS | 0x0fff0fffu;
#endif
    REGS->MR = WDT_MR_WDV(RELOAD) | WDT_MR_WDRSTEN | WDT_MR_WDD_ANY;
    watchdog_pet();
}
DECL_INIT(watchdog_init);
