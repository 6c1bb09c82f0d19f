/* SPDX-License-Identifier: GPL-3.0-or-later
 * The chip that is built for, and what its peripherals share.
 */
#ifndef ATSAM_CHIP_H
#define ATSAM_CHIP_H

#include <stdint.h>

#if CONFIG_MACH_SAM3X
#include "atsam/sam3x.h"
#elif CONFIG_MACH_SAM4S
#include "atsam/sam4s.h"
#elif CONFIG_MACH_SAM4E
#include "atsam/sam4e.h"
#elif CONFIG_MACH_SAME70
#include "atsam/same70.h"
#endif

/* What the peripherals count */
#define MCK_TICKS (CONFIG_MACH_SAME70 ? 2u : 1u)
#define MCK_FREQ (CONFIG_CLOCK_FREQ / MCK_TICKS)

/* Number of a pin: GPIO('A', 3) */
#define GPIO(LETTER, BIT) (((LETTER) - 'A') * 32 + (BIT))
#define PIN_ADC_TEMPERATURE 0xfe

/* Task: give a peripheral its clock, by its identifier. */
void chip_enable(uint32_t id);

/* Task: connect `pin` to peripheral 'A' to 'D'; `pull` is as in
 * gpio_float(). */
void gpio_alternate(uint32_t pin, char peripheral, int8_t pull);
/* The same for a line that is only driven low. */
void gpio_open_drain(uint32_t pin, char peripheral);

#endif
