/* SPDX-License-Identifier: GPL-3.0-or-later
 * SAM E70: DS60001527, 10 (addresses), 14.1 (identifiers of peripherals).
 */
#ifndef ATSAM_SAME70_H
#define ATSAM_SAME70_H

#include "atsam/periph.h"

#define MATRIX_BASE 0x40088000
#define PMC_BASE 0x400e0600
#define EFC0_BASE 0x400e0c00
#define WDT_BASE 0x400e1850
#define RSWDT_BASE 0x400e1900

#define PIOA_BASE 0x400e0e00
#define PIOA_ID 10
#define PIOB_ID 11
#define PIOC_ID 12
#define PIOD_ID 16
#define PIOE_ID 17

#define UART0_BASE 0x400e0800
#define UART0_ID 7
#define UART2_BASE 0x400e1a00
#define UART2_ID 44

#define USART0_BASE 0x40024000
#define USART0_ID 13
#define USART1_BASE 0x40028000
#define USART1_ID 14
#define USART2_BASE 0x4002c000
#define USART2_ID 15
#define SPI0_BASE 0x40008000
#define SPI0_ID 21
#define SPI1_BASE 0x40058000
#define SPI1_ID 42
#define TWI0_BASE 0x40018000
#define TWI0_ID 19
#define TWI1_BASE 0x4001c000
#define TWI1_ID 20
#define TWI2_BASE 0x40060000
#define TWI2_ID 41
#define USBHS_BASE 0x40038000
#define USBHS_ID 34
#define USBHS_MEMORY 0xa0100000
#define MCAN0_BASE 0x40030000
#define MCAN0_ID 35
#define MCAN1_BASE 0x40034000
#define MCAN1_ID 37
#define PWM_BASE 0x40020000
#define PWM_ID 31
#define PWM1_BASE 0x4005c000
#define PWM1_ID 60
#define AFEC0_BASE 0x4003c000
#define AFEC0_ID 29
#define AFEC1_BASE 0x40064000
#define AFEC1_ID 40

#endif
