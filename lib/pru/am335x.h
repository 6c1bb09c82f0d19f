/* SPDX-License-Identifier: GPL-3.0-or-later
 * Registers of the AM335x that a PRU uses.  SPRUH73 (AM335x technical reference
 * manual): PRU subsystem, chapter 4; clocks, 8.1.12; touchscreen and analog
 * inputs, chapter 12; pins, chapter 25.
 */
#ifndef LIB_PRU_AM335X_H
#define LIB_PRU_AM335X_H

#include <stdint.h>

#define REG32(ADDR) (*(volatile uint32_t *)(ADDR))

/* --- Of the subsystem, at local addresses (4.3.1) --- */

/* System configuration (4.5.8): in standby it is no master of the bus */
#define PRUCFG_SYSCFG REG32(0x26004)
#define SYSCFG_STANDBY_INIT (1u << 4)

/* Event controller (4.5.3): an event's number clears it */
#define INTC_SICR REG32(0x20024)

/* Industrial Ethernet peripheral, of which only the counter (4.5.4) */
#define IEP_GLOBAL_CFG REG32(0x2e000)
#define IEP_COUNT REG32(0x2e00c)
#define IEP_CFG_ENABLE 1u
#define IEP_CFG_STEP(N) ((uint32_t)(N) << 4)

/* The event register r31 (4.4.1.2): reading, bits of hosts 0 and 1; writing,
 * an event of 16 to 31 */
#define R31_HOST0 (1u << 30)
#define R31_RAISE(EVENT) (0x20u | ((EVENT) - 16u))

/* --- Of the chip --- */

/* Clocks of blocks (8.1.12.1, 8.1.12.2) */
#define CM_GPIO0 REG32(0x44e00408)
#define CM_GPIO1 REG32(0x44e000ac)
#define CM_GPIO2 REG32(0x44e000b0)
#define CM_GPIO3 REG32(0x44e000b4)
#define CM_ADC REG32(0x44e004bc)
#define CM_MODULE_MASK 3u
#define CM_MODULE_ENABLE 2u
#define CM_IDLE_MASK (3u << 16)

/* Pins (25.4): banks, and offsets in one */
#define GPIO0_BASE 0x44e07000u
#define GPIO1_BASE 0x4804c000u
#define GPIO2_BASE 0x481ac000u
#define GPIO3_BASE 0x481ae000u
#define GPIO_OE 0x134u
#define GPIO_DATAIN 0x138u
#define GPIO_CLEARDATAOUT 0x190u
#define GPIO_SETDATAOUT 0x194u
#define GPIO_SET_AFTER_CLEAR (GPIO_SETDATAOUT - GPIO_CLEARDATAOUT)

/* Analog inputs (12.5): 16 steps, each one reading */
#define ADC_CTRL REG32(0x44e0d040)
#define ADC_CLKDIV REG32(0x44e0d04c)
#define ADC_STEPENABLE REG32(0x44e0d054)
#define ADC_STEPCONFIG(N) REG32(0x44e0d064u + 8u * (N))
#define ADC_STEPDELAY(N) REG32(0x44e0d068u + 8u * (N))
#define ADC_FIFO0COUNT REG32(0x44e0d0e4)
#define ADC_FIFO0DATA REG32(0x44e0d100)
#define ADC_CTRL_ENABLE (1u << 0)
#define ADC_CTRL_STEP_ID (1u << 1)
#define ADC_CTRL_UNLOCK (1u << 2)
/* Average of 16, of one input against ground */
#define ADC_STEP_AVERAGE16 (4u << 2)
#define ADC_FIFO_VALUE(DATA) ((uint16_t)((DATA) & 0xfff))
#define ADC_FIFO_STEP(DATA) ((DATA) >> 16 & 15)
#define ADC_STEP_INPUT(N) ((uint32_t)(N) << 19 | 8u << 15)

#endif
