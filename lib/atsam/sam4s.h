/* SPDX-License-Identifier: GPL-3.0-or-later
 * SAM4S: 11100, 8 (addresses), 11.1 (identifiers of peripherals).
 */
#ifndef ATSAM_SAM4S_H
#define ATSAM_SAM4S_H

#include "atsam/periph.h"

#define MATRIX_BASE 0x400e0200
#define PMC_BASE 0x400e0400
#define EFC0_BASE 0x400e0a00
#define WDT_BASE 0x400e1450

#define PIOA_BASE 0x400e0e00
#define PIOA_ID 11
#define PIOB_ID 12
#define PIOC_ID 13

#define UART0_BASE 0x400e0600
#define UART0_ID 8
#define UART1_BASE 0x400e0800
#define UART1_ID 9

#define USART0_BASE 0x40024000
#define USART0_ID 14
#define USART1_BASE 0x40028000
#define USART1_ID 15
#define SPI_BASE 0x40008000
#define SPI_ID 21
#define TWI0_BASE 0x40018000
#define TWI0_ID 19
#define TWI1_BASE 0x4001c000
#define TWI1_ID 20
#define PWM_BASE 0x40020000
#define PWM_ID 31
#define UDP_BASE 0x40034000
#define UDP_ID 34
#define ADC_BASE 0x40038000
#define ADC_ID 29

#endif
