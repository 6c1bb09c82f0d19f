/* SPDX-License-Identifier: GPL-3.0-or-later
 * SAM4E: 11157, 7 (addresses), 10.1 (identifiers of peripherals).
 */
#ifndef ATSAM_SAM4E_H
#define ATSAM_SAM4E_H

#include "atsam/periph.h"

#define MATRIX_BASE 0x400e0200
#define PMC_BASE 0x400e0400
#define EFC0_BASE 0x400e0a00
#define WDT_BASE 0x400e1850
#define RSWDT_BASE 0x400e1900

#define PIOA_BASE 0x400e0e00
#define PIOA_ID 9
#define PIOB_ID 10
#define PIOC_ID 11
#define PIOD_ID 12
#define PIOE_ID 13

#define UART0_BASE 0x400e0600
#define UART0_ID 7
#define UART1_BASE 0x40060600
#define UART1_ID 45

#define USART0_BASE 0x400a0000
#define USART0_ID 14
#define USART1_BASE 0x400a4000
#define USART1_ID 15
#define SPI_BASE 0x40088000
#define SPI_ID 19
#define TWI0_BASE 0x400a8000
#define TWI0_ID 17
#define TWI1_BASE 0x400ac000
#define TWI1_ID 18
#define PWM_BASE 0x40000000
#define PWM_ID 36
#define UDP_BASE 0x40084000
#define UDP_ID 35
#define AFEC0_BASE 0x400b0000
#define AFEC0_ID 30
#define AFEC1_BASE 0x400b4000
#define AFEC1_ID 31

#endif
