/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: I2C masters.  port.h defines struct i2c_config.
 *
 * The port declares its buses: DECL_ENUMERATION("i2c_bus", "<name>", n) and,
 * where they are fixed, DECL_CONSTANT_STR("BUS_PINS_<name>", "scl,sda").
 */
#ifndef BOARD_I2C_H
#define BOARD_I2C_H

#include <stdint.h>
#include "port.h"

enum i2c_result {
    I2C_OK = 0,
    I2C_NACK,            /* a written byte was not acknowledged */
    I2C_START_NACK,      /* nobody answers the address for writing */
    I2C_START_READ_NACK, /* nor, after a write, for reading */
    I2C_TIMEOUT,         /* the bus did not move for 50 us a bit */
};

/* --- The port provides --- */

/* Task: settings for one device; rate in Hz, addr 7 bits.
 * shutdown("Unsupported i2c bus") if there is no such bus. */
struct i2c_config i2c_setup(uint32_t bus, uint32_t rate, uint8_t addr);

/* Task: write then, with a repeated start, read; either length may be 0.
 * Blocks for the transfer: 9 * (lengths + 2) bit times. */
enum i2c_result i2c_transfer(struct i2c_config config, uint8_t write_len,
                             const uint8_t *write, uint8_t read_len,
                             uint8_t *read);

#endif
