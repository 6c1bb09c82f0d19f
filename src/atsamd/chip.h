/* SPDX-License-Identifier: GPL-3.0-or-later
 * The chip that is built for, and what its peripherals share.
 */
#ifndef ATSAMD_CHIP_H
#define ATSAMD_CHIP_H

#include <stdint.h>
#include "port.h"

/* Number of a pin: GPIO('A', 3) */
#define GPIO(LETTER, BIT) (((LETTER) - 'A') * 32 + (BIT))
#define GPIO_NONE 0xff
#define PIN_ADC_TEMPERATURE 0xfe
#define PIN_ADC_TEMPERATURE_CTAT 0xfd

/* Generators: 0 is the processor's, 1 that of peripherals */
#if CONFIG_MACH_SAMX5
#define GEN_PERIPHERALS 1
#else
#define GEN_PERIPHERALS 0
#endif
#define PERIPHERAL_HZ 48000000

/* A peripheral's function at a pin: A to N */
enum { MUX_B = 1, MUX_C, MUX_D, MUX_E, MUX_F, MUX_G, MUX_H, MUX_I };

/* Task or start: clock of a bus interface on. */
void chip_enable(uint32_t gate);

/* Task or start: feed a peripheral from a generator. */
void chip_feed(uint32_t channel, uint32_t generator);

/* Task: connect `pin` to a peripheral; inputs stay readable.  `pull` is as in
 * gpio_float(). */
void gpio_mux(uint32_t pin, uint32_t mux, int8_t pull);

#endif
