/* SPDX-License-Identifier: GPL-3.0-or-later
 * RP2350: data sheet, 2.2 (addresses), 3.2 (interrupts), 7.5 (resets), 3.1.11
 * (SIO), 8.5 (ticks), 5.4 (boot ROM), 13 (OTP).
 */
#ifndef RP2040_RP2350_H
#define RP2040_RP2350_H

/* 11.7: queues without order, and which pins the first is */
#define PIO_MORE_REGS volatile uint32_t RXF_PUTGET[4][4], GPIOBASE;
#include "rp2040/blocks.h"

#define CLOCKS_BASE 0x40010000
#define PSM_BASE 0x40018000
#define RESETS_BASE 0x40020000
#define IO_BANK0_BASE 0x40028000
#define PADS_BANK0_BASE 0x40038000
#define XOSC_BASE 0x40048000
#define PLL_SYS_BASE 0x40050000
#define PLL_USB_BASE 0x40058000
#define UART0_BASE 0x40070000
#define UART1_BASE 0x40078000
#define SPI0_BASE 0x40080000
#define SPI1_BASE 0x40088000
#define I2C0_BASE 0x40090000
#define I2C1_BASE 0x40098000
#define ADC_BASE 0x400a0000
#define PWM_BASE 0x400a8000
#define WATCHDOG_BASE 0x400d8000
#define TICKS_BASE 0x40108000
#define OTP_DATA_BASE 0x40130000
#define USB_MEMORY_BASE 0x50100000
#define USB_BASE 0x50110000

#define USBCTRL_IRQ 14
#define PIO0_IRQ 15
#define SIO_FIFO_IRQ 25
#define SIO_FIFO_IRQ_CORE1 25
#define UART0_IRQ 33
#define UART1_IRQ 34

/* Bits of RESETS */
#define RESET_ADC 0
#define RESET_I2C0 4
#define RESET_I2C1 5
#define RESET_IO_BANK0 6
#define RESET_IO_QSPI 7
#define RESET_PADS_BANK0 9
#define RESET_PADS_QSPI 10
#define RESET_PIO0 11
#define RESET_PLL_SYS 14
#define RESET_PLL_USB 15
#define RESET_PWM 16
#define RESET_SPI0 18
#define RESET_SPI1 19
#define RESET_UART0 26
#define RESET_UART1 27
#define RESET_USBCTRL 28
#define RESETS_ALL 0x1fffffffu

/* CLOCKS: which set of registers */
#define CLOCK_REF 4
#define CLOCK_SYS 5
#define CLOCK_PERI 6
#define CLOCK_USB 8
#define CLOCK_ADC 9

/* PSM: all but the two oscillators */
#define PSM_WDSEL_ALL 0x01fffff3u

/* A pad is cut off from the pin's logic until its settings are right (9.7) */
#define PAD_ISOLATED (1u << 8)

/* SIO: pins from 32 on have each register one word later */
struct sio_regs {
    volatile uint32_t CPUID, IN, HI_IN, reserved0, OUT, reserved1, OUT_SET;
    volatile uint32_t reserved2, OUT_CLR, reserved3, OUT_XOR, reserved4, OE;
    volatile uint32_t reserved5, OE_SET, reserved6, OE_CLR, reserved7, OE_XOR;
};
#define SIO_BASE 0xd0000000

/* Ticks of the watchdog: cycles of the reference to one */
struct tick_regs {
    volatile uint32_t CTRL, CYCLES, COUNT;
};
#define TICKS_WATCHDOG 4

/* Boot ROM: half word at this address; what is wanted for */
#define ROM_LOOKUP 0x16
#define ROM_CODE(A, B) ((uint32_t)(A) | (uint32_t)(B) << 8)
#define ROM_FOR_SECURE_ARM 4
#define ROM_REBOOT_TO_BOOTSEL 0x102

#endif
