/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of peripherals. */
#include "board/irq.h"
#include "chip.h"
#include "core/decl.h"

#if !CONFIG_STM32_CLOCK_REF_INTERNAL
#if CONFIG_MACH_STM32F0 || CONFIG_MACH_STM32G0 || CONFIG_MACH_STM32G4
DECL_CONSTANT_STR("RESERVE_PINS_crystal", "PF0,PF1");
#elif CONFIG_STM32_F2F4F7 || CONFIG_MACH_STM32H7 || CONFIG_MACH_STM32L4
DECL_CONSTANT_STR("RESERVE_PINS_crystal", "PH0,PH1");
#endif
#endif

void chip_enable(uint32_t gate)
{
    volatile uint32_t *reg = (volatile uint32_t *)(RCC_BASE + (gate >> 5));
    uint32_t bit = 1u << (gate & 31);
    irq_flag_t flag;

    if (*reg & bit)
        return;
    flag = irq_save();
    *reg |= bit;
    irq_restore(flag);
    /* two cycles until it can be used: reading back takes those */
    (void)*reg;
}
