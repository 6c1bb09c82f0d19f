/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of peripherals. */
#include "board/irq.h"
#include "chip.h"

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
