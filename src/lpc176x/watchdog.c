/* SPDX-License-Identifier: GPL-3.0-or-later
 * The watchdog: 500 ms of the internal oscillator of 4 MHz, whose clock is
 * divided by four (UM10360, 28.4). */
#include "board/irq.h"
#include "board/reset.h"
#include "board/watchdog.h"
#include "chip.h"
#include "core/sched.h"

#define REGS ((struct wdt_regs *)WDT_BASE)
#define RELOAD (4000000 / 4 / 2)

/* Nothing may come between the two words. */
void watchdog_pet(void)
{
    irq_flag_t flag = irq_save();

    REGS->FEED = 0xaa;
    REGS->FEED = 0x55;
    irq_restore(flag);
}

void watchdog_init(void)
{
    REGS->CLKSEL = WDT_CLKSEL_IRC;
    REGS->TC = RELOAD;
    REGS->MOD = WDT_MOD_RESET;
    watchdog_pet();
}
DECL_INIT(watchdog_init);

/* Boot loaders of the field (Smoothieware's) take a reset by the watchdog for
 * the wish to be given new firmware: let it bite at once. */
void reset_to_bootloader(void)
{
    irq_disable();
    REGS->TC = 0;
    REGS->MOD = WDT_MOD_RESET;
    watchdog_pet();
    for (;;)
        ;
}
