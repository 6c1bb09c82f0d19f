/* SPDX-License-Identifier: GPL-3.0-or-later
 * MCAN of a SAM E70, for src/generic/mcan.c (DS60001527, 49).
 */
#ifndef ATSAM_MCAN_UNIT_H
#define ATSAM_MCAN_UNIT_H

#include "chip.h"

#if CONFIG_ATSAM_CAN_PB3_PB2
DECL_CONSTANT_STR("RESERVE_PINS_CAN", "PB3,PB2");
#define CAN_RX GPIO('B', 3)
#define CAN_TX GPIO('B', 2)
#define CAN_RX_PERIPHERAL 'A'
#define CAN_TX_PERIPHERAL 'A'
#define MCAN_BASE MCAN0_BASE
#define MCAN_IRQ MCAN0_ID
#define MCAN_MEMORY_PAGE CCFG_CAN0
#else
DECL_CONSTANT_STR("RESERVE_PINS_CAN", "PC12,PD12");
#define CAN_RX GPIO('C', 12)
#define CAN_TX GPIO('D', 12)
#define CAN_RX_PERIPHERAL 'C'
#define CAN_TX_PERIPHERAL 'B'
#define MCAN_BASE MCAN1_BASE
#define MCAN_IRQ MCAN1_ID
#define MCAN_MEMORY_PAGE CCFG_SYSIO
#endif

/* Both count programmable clock 5, a fifth of the PLL. */
#define MCAN_DIVIDER 5u
#define MCAN_HZ (CONFIG_CLOCK_FREQ / MCAN_DIVIDER)

/* In plain memory, which the processor caches otherwise. */
#define MCAN_WORDS 128
#define MCAN_LOG2_SIZE 9
static volatile uint32_t mcan_memory[MCAN_WORDS]
    __attribute__((aligned(1 << MCAN_LOG2_SIZE)));
#define MCAN_MEMORY mcan_memory
#define MCAN_START ((uint32_t)mcan_memory & 0xffff)

static inline void mcan_start_clock(void)
{
    PMC->SCDR = PMC_SCER_PCK(5);
    PMC->PCK[5] = PMC_PCK_CSS_PLLA | PMC_PCK_PRES(MCAN_DIVIDER);
    PMC->SCER = PMC_SCER_PCK(5);
    while (!(PMC->SR & PMC_SR_PCKRDY(5)))
        ;
}

static inline void mcan_connect(void)
{
    mcan_start_clock();
    chip_enable(MCAN_IRQ);
    gpio_alternate(CAN_RX, CAN_RX_PERIPHERAL, 1);
    gpio_alternate(CAN_TX, CAN_TX_PERIPHERAL, 0);
    armcm_uncache(mcan_memory, MCAN_LOG2_SIZE);
    MCAN_MEMORY_PAGE = (MCAN_MEMORY_PAGE & 0xffff)
        | ((uint32_t)mcan_memory & 0xffff0000);
}

#endif
