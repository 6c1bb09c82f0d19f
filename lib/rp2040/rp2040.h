/* SPDX-License-Identifier: GPL-3.0-or-later
 * RP2040: data sheet, 2.2 (addresses), 2.3.2 (interrupts), 2.14.1 (resets),
 * 2.3.1 (SIO), 4.10 (SSI), 2.8 (boot ROM).
 */
#ifndef RP2040_RP2040_H
#define RP2040_RP2040_H

#define PIO_MORE_REGS
#include "rp2040/blocks.h"

#define CLOCKS_BASE 0x40008000
#define RESETS_BASE 0x4000c000
#define PSM_BASE 0x40010000
#define IO_BANK0_BASE 0x40014000
#define IO_QSPI_BASE 0x40018000
#define PADS_BANK0_BASE 0x4001c000
#define XOSC_BASE 0x40024000
#define PLL_SYS_BASE 0x40028000
#define PLL_USB_BASE 0x4002c000
#define UART0_BASE 0x40034000
#define UART1_BASE 0x40038000
#define SPI0_BASE 0x4003c000
#define SPI1_BASE 0x40040000
#define I2C0_BASE 0x40044000
#define I2C1_BASE 0x40048000
#define ADC_BASE 0x4004c000
#define PWM_BASE 0x40050000
#define TIMER_BASE 0x40054000
#define WATCHDOG_BASE 0x40058000
#define USB_MEMORY_BASE 0x50100000
#define USB_BASE 0x50110000

#define TIMER_IRQ 0
#define USBCTRL_IRQ 5
#define PIO0_IRQ 7
#define SIO_FIFO_IRQ 15
#define SIO_FIFO_IRQ_CORE1 16
#define UART0_IRQ 20
#define UART1_IRQ 21

/* Bits of RESETS */
#define RESET_ADC 0
#define RESET_I2C0 3
#define RESET_I2C1 4
#define RESET_IO_BANK0 5
#define RESET_IO_QSPI 6
#define RESET_PADS_BANK0 8
#define RESET_PADS_QSPI 9
#define RESET_PIO0 10
#define RESET_PLL_SYS 12
#define RESET_PLL_USB 13
#define RESET_PWM 14
#define RESET_SPI0 16
#define RESET_SPI1 17
#define RESET_TIMER 21
#define RESET_UART0 22
#define RESET_UART1 23
#define RESET_USBCTRL 24
#define RESETS_ALL 0x01ffffffu

/* CLOCKS: which set of registers */
#define CLOCK_REF 4
#define CLOCK_SYS 5
#define CLOCK_PERI 6
#define CLOCK_USB 7
#define CLOCK_ADC 8

/* PSM: all but the two oscillators */
#define PSM_WDSEL_ALL 0x1fffcu

#define PAD_ISOLATED 0u

/* 2.3.1.7 SIO */
struct sio_regs {
    volatile uint32_t CPUID, IN, HI_IN, reserved0, OUT, OUT_SET, OUT_CLR;
    volatile uint32_t OUT_XOR, OE, OE_SET, OE_CLR, OE_XOR;
};
#define SIO_BASE 0xd0000000

/* 4.10.13 SSI, the interface of the flash chip */
struct ssi_regs {
    volatile uint32_t CTRLR0, CTRLR1, SSIENR, MWCR, SER, BAUDR, TXFTLR, RXFTLR;
    volatile uint32_t TXFLR, RXFLR, SR, IMR, ISR, RISR, TXOICR, RXOICR, RXUICR;
    volatile uint32_t MSTICR, ICR, DMACR, DMATDLR, DMARDLR, IDR, VERSION, DR0;
};
#define SSI_BASE 0x18000000
#define SSI_CTRLR0_FRAME(BITS) (((uint32_t)(BITS) - 1) << 16)
#define SSI_SR_BUSY (1u << 0)
#define SSI_SR_RFNE (1u << 3)

/* 2.8.3 boot ROM: half words at these addresses */
#define ROM_TABLE 0x14
#define ROM_LOOKUP 0x18
#define ROM_CODE(A, B) ((uint32_t)(A) | (uint32_t)(B) << 8)

#endif
