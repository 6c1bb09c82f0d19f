/* SPDX-License-Identifier: GPL-3.0-or-later
 * Devices on an I2C bus, of the chip or in software.
 */
#ifndef BUS_I2C_DEVICE_H
#define BUS_I2C_DEVICE_H

#include <stdint.h>
#include "board/i2c.h"

struct i2c_device;

/* Task: the object of config_i2c. */
struct i2c_device *i2c_device_lookup(uint8_t oid);

/* Task: write, then read; either length may be 0.  Shutdown if the device has
 * no bus yet. */
enum i2c_result i2c_device_transfer(const struct i2c_device *device,
                                    uint8_t write_len, const uint8_t *write,
                                    uint8_t read_len, uint8_t *read);

/* Task: read `len` bytes that begin with register `reg`. */
enum i2c_result i2c_device_read(const struct i2c_device *device, uint8_t reg,
                                uint8_t len, uint8_t *data);

#endif
