/* SPDX-License-Identifier: GPL-3.0-or-later
 * I2C on any pins, bit by bit.  The only master of its bus.
 */
#ifndef BUS_I2C_SOFTWARE_H
#define BUS_I2C_SOFTWARE_H

#include <stdint.h>
#include "board/gpio.h"
#include "board/i2c.h"

/* Driven low, or let go and pulled up. */
struct i2c_line {
    struct gpio_out out;
    struct gpio_in in;
};

struct i2c_software {
    struct i2c_line scl, sda;
    uint32_t pulse_ticks;  /* half a bit, at least */
    uint8_t addr;          /* 7 bits */
};

/* Task: take the pins and let go of the lines. */
struct i2c_software i2c_software_setup(uint32_t scl_pin, uint32_t sda_pin,
                                       uint32_t pulse_ticks, uint8_t addr);

/* Task: as i2c_transfer(); without any data only the address is sent, for
 * writing.  A device may hold the clock for a millisecond. */
enum i2c_result i2c_software_transfer(const struct i2c_software *bus,
                                      uint8_t write_len, const uint8_t *write,
                                      uint8_t read_len, uint8_t *read);

#endif
