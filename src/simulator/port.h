/* SPDX-License-Identifier: GPL-3.0-or-later
 * Handles of the simulated mcu, and its insides (simulator__*).
 */
#ifndef SIMULATOR_PORT_H
#define SIMULATOR_PORT_H

#include <stdint.h>

typedef uint8_t irq_flag_t;

struct gpio_out { uint8_t pin; };
struct gpio_in { uint8_t pin; };
struct gpio_adc { uint8_t pin; };
struct gpio_pwm { uint8_t pin; };
struct spi_config { uint8_t bus; };
struct i2c_config { uint8_t bus, addr; };

#define SIMULATOR_PINS 256
#define SIMULATOR_PIN_TEMPERATURE 254
#define SIMULATOR_BUSES 8

/* clock.c: time passes by exactly this much. */
void simulator_delay(uint32_t ticks);
#define PORT_DELAY_TICKS simulator_delay

#endif
