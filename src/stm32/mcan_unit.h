/* SPDX-License-Identifier: GPL-3.0-or-later
 * FDCAN of an STM32, for src/generic/mcan.c (RM0444, 36; RM0433, 59).
 */
#ifndef STM32_MCAN_UNIT_H
#define STM32_MCAN_UNIT_H

#include "chip.h"
#include "can_pins.h"

#define MCAN_BASE STM32_JOIN(FDCAN, CAN_UNIT, _BASE)
#define MCAN_IRQ STM32_JOIN(FDCAN, CAN_UNIT, _IRQ)

/* The units share one memory. */
#if CONFIG_MACH_STM32H7
#define MCAN_WORDS 128
#define MCAN_START (4u * MCAN_WORDS * (CAN_UNIT - 1))
#else
#define MCAN_WORDS (0x350 / 4)
#endif
#define MCAN_MEMORY \
    ((volatile uint32_t *)FDCAN_RAM + (CAN_UNIT - 1) * MCAN_WORDS)

#if CONFIG_MACH_STM32H723
#define MCAN_HZ 40000000
#elif CONFIG_MACH_STM32H7
#define MCAN_HZ 80000000
#else
#define MCAN_HZ CONFIG_CLOCK_FREQ
#endif

static inline void mcan_connect(void)
{
#if CONFIG_MACH_STM32G4
    RCC_CCIPR = (RCC_CCIPR & ~RCC_CCIPR_FDCAN) | RCC_CCIPR_FDCAN_PCLK;
#elif CONFIG_MACH_STM32H7
    RCC->D2CCIP1R = (RCC->D2CCIP1R & ~RCC_D2CCIP1R_FDCAN)
        | RCC_D2CCIP1R_FDCAN_PLL1Q;
#endif
    chip_enable(FDCAN_GATE);
    gpio_alternate(CAN_RX, CAN_FUNCTION(CAN_RX), 1);
    gpio_alternate(CAN_TX, CAN_FUNCTION(CAN_TX), 0);
}

#endif
