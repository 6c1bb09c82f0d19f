/* SPDX-License-Identifier: GPL-3.0-or-later
 * Handles of the linux process.  They point into tables of the port.
 */
#ifndef LINUX_PORT_H
#define LINUX_PORT_H

#include <stdint.h>

typedef uint8_t irq_flag_t;

struct gpio_out { struct gpio_line *line; };
struct gpio_in { struct gpio_line *line; };
struct gpio_adc { struct adc_input *input; };
struct gpio_pwm { struct pwm_channel *channel; };
struct spi_config { struct spi_bus *bus; uint32_t rate; uint8_t mode; };
struct i2c_config { struct i2c_bus *bus; uint8_t addr; };

/* How late a step may be is the user's choice (--max-late). */
extern uint32_t clock_max_step_lag_us;
#define STEPPER_MAX_LAG_US clock_max_step_lag_us

#endif
