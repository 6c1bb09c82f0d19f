/* SPDX-License-Identifier: GPL-3.0-or-later
 * The independent watchdog: 500 ms of an oscillator of 32 to 40 kHz. */
#include "board/watchdog.h"
#include "chip.h"
#include "core/sched.h"

#define REGS ((struct iwdg_regs *)IWDG_BASE)

/* PR: divide by 4 << value */
#define DIVIDER_16 2
#define RELOAD (32000 / 16 / 2)

void watchdog_pet(void)
{
    REGS->KR = IWDG_KEY_RELOAD;
}

void watchdog_init(void)
{
    REGS->KR = IWDG_KEY_START;
    REGS->KR = IWDG_KEY_UNLOCK;
    REGS->PR = DIVIDER_16;
    REGS->RLR = RELOAD;
    while (REGS->SR)
        ;
    watchdog_pet();
}
DECL_INIT(watchdog_init);
