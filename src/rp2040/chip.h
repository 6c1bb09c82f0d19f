/* SPDX-License-Identifier: GPL-3.0-or-later
 * The chip that is built for, its clocks, and what its peripherals share.
 */
#ifndef RP2040_CHIP_H
#define RP2040_CHIP_H

#include <stdint.h>
#include "port.h"

#define XOSC_FREQ 12000000
#define SYS_FREQ (SYS_MHZ * 1000000)

#define RESETS ((struct resets_regs *)RESETS_BASE)
#define WATCHDOG ((struct watchdog_regs *)WATCHDOG_BASE)
#define PSM ((struct psm_regs *)PSM_BASE)

#define PIN_ADC_TEMPERATURE 0xfe
#define ADC_FIRST_PIN 26
#define ADC_PINS 4

/* Task or start: take a peripheral out of reset; it may be used at once. */
void chip_enable(uint32_t reset_bit);

/* Task: let `pin` belong to a peripheral (IO_SPI ...), with a pull as in
 * gpio_float(). */
void gpio_function(uint32_t pin, uint32_t function, int8_t pull);

/* Task: nothing digital at `pin`. */
void gpio_analog(uint32_t pin);

#endif
