/* SPDX-License-Identifier: GPL-3.0-or-later
 * SAM3X: 11057, 7.1 (addresses), 9.1 (identifiers of peripherals, which are
 * numbers of clocks and of interrupts).
 */
#ifndef ATSAM_SAM3X_H
#define ATSAM_SAM3X_H

#include "atsam/periph.h"

#define MATRIX_BASE 0x400e0400
#define PMC_BASE 0x400e0600
#define EFC0_BASE 0x400e0a00
#define EFC1_BASE 0x400e0c00
#define WDT_BASE 0x400e1a50

#define PIOA_BASE 0x400e0e00
#define PIOA_ID 11
#define PIOB_ID 12
#define PIOC_ID 13
#define PIOD_ID 14

#define UART_BASE 0x400e0800
#define UART_ID 8

#define USART0_BASE 0x40098000
#define USART0_ID 17
#define USART1_BASE 0x4009c000
#define USART1_ID 18
#define USART2_BASE 0x400a0000
#define USART2_ID 19
#define SPI0_BASE 0x40008000
#define SPI0_ID 24
#define TWI0_BASE 0x4008c000
#define TWI0_ID 22
#define TWI1_BASE 0x40090000
#define TWI1_ID 23
#define USBHS_BASE 0x400ac000
#define USBHS_ID 40
#define USBHS_MEMORY 0x20180000
#define PWM_BASE 0x40094000
#define PWM_ID 36
#define ADC_BASE 0x400c0000
#define ADC_ID 37

#endif
