/* SPDX-License-Identifier: GPL-3.0-or-later
 * Handles of the fake board. */
#ifndef FAKEBOARD_PORT_H
#define FAKEBOARD_PORT_H

#include <stdint.h>

typedef uint8_t irq_flag_t;
struct gpio_out { uint8_t pin; };
struct gpio_in { uint8_t pin; };
struct gpio_adc { uint8_t pin; };
struct gpio_pwm { uint8_t pin; };
struct spi_config { uint8_t bus; };
struct i2c_config { uint8_t bus; };

void fake_delay(uint32_t ticks);
#define PORT_DELAY_TICKS fake_delay

#endif
