/* SPDX-License-Identifier: GPL-3.0-or-later
 * The watchdog: 500 ms of an oscillator of about 1024 Hz (data sheets, WDT). */
#include "board/watchdog.h"
#include "chip.h"
#include "core/sched.h"

#define WDT_CTRL SAMD_REG8(WDT_BASE)
#define WDT_CONFIG SAMD_REG8(WDT_BASE + 1)
#define WDT_CTRL_ENABLE (1u << 1)
#define WDT_CONFIG_512 6u
#define WDT_KEY 0xa5

/* A write that is under way stands for this one. */
void watchdog_pet(void)
{
    if (!WDT_BUSY)
        WDT_CLEAR = WDT_KEY;
}

void watchdog_init(void)
{
    WDT_CONFIG = WDT_CONFIG_512;
    while (WDT_BUSY)
        ;
    WDT_CTRL = WDT_CTRL_ENABLE;
    while (WDT_BUSY)
        ;
}
DECL_INIT(watchdog_init);
