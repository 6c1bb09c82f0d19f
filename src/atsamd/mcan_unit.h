/* SPDX-License-Identifier: GPL-3.0-or-later
 * CAN of a SAM C21 or E5x, for src/generic/mcan.c (DS60001479, 34; DS60001507,
 * 39).
 */
#ifndef ATSAMD_MCAN_UNIT_H
#define ATSAMD_MCAN_UNIT_H

#include "chip.h"

#if CONFIG_ATSAMD_CAN_PA25_PA24
DECL_CONSTANT_STR("RESERVE_PINS_CAN", "PA25,PA24");
#define CAN_RX GPIO('A', 25)
#define CAN_TX GPIO('A', 24)
#define CAN_UNIT 0
#elif CONFIG_ATSAMD_CAN_PB11_PB10
DECL_CONSTANT_STR("RESERVE_PINS_CAN", "PB11,PB10");
#define CAN_RX GPIO('B', 11)
#define CAN_TX GPIO('B', 10)
#define CAN_UNIT 1
#elif CONFIG_ATSAMD_CAN_PB13_PB12
DECL_CONSTANT_STR("RESERVE_PINS_CAN", "PB13,PB12");
#define CAN_RX GPIO('B', 13)
#define CAN_TX GPIO('B', 12)
#define CAN_UNIT 1
#elif CONFIG_ATSAMD_CAN_PB15_PB14
DECL_CONSTANT_STR("RESERVE_PINS_CAN", "PB15,PB14");
#define CAN_RX GPIO('B', 15)
#define CAN_TX GPIO('B', 14)
#define CAN_UNIT 1
#else
DECL_CONSTANT_STR("RESERVE_PINS_CAN", "PA23,PA22");
#define CAN_RX GPIO('A', 23)
#define CAN_TX GPIO('A', 22)
#define CAN_UNIT 0
#endif

#if CONFIG_MACH_SAMC21
#define CAN_MUX MUX_G
#else
#define CAN_MUX (CAN_UNIT ? MUX_H : MUX_I)
#endif

#define MCAN_BASE (CAN_UNIT ? CAN1_BASE : CAN0_BASE)
#define MCAN_IRQ (CAN_UNIT ? CAN1_IRQ : CAN0_IRQ)
#define MCAN_HZ PERIPHERAL_HZ

/* In the first 64 KiB of memory (link.lds.S sees to it) */
#define MCAN_WORDS 128
static volatile uint32_t mcan_memory[MCAN_WORDS] __attribute__((aligned(4)));
#define MCAN_MEMORY mcan_memory
#define MCAN_START ((uint32_t)mcan_memory & 0xffff)

static inline void mcan_connect(void)
{
    chip_enable(CAN_UNIT ? CAN1_GATE : CAN0_GATE);
    chip_feed(CAN_UNIT ? CHANNEL_CAN1 : CHANNEL_CAN0, GEN_PERIPHERALS);
    gpio_mux(CAN_RX, CAN_MUX, 1);
    gpio_mux(CAN_TX, CAN_MUX, 0);
}

#endif
