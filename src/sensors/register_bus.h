/* SPDX-License-Identifier: GPL-3.0-or-later
 * Registers of a chip behind SPI or I2C, whichever it is wired to.
 */
#ifndef SENSORS_REGISTER_BUS_H
#define SENSORS_REGISTER_BUS_H

#include <stdbool.h>
#include <stdint.h>
#include "core/decl.h"

enum register_bus_type { REGISTER_BUS_SPI, REGISTER_BUS_I2C };
enum { REGISTER_BUS_READ_MAX = 48 };

struct register_bus {
    uint8_t type;
    const void *device;
};

/* Task: the device with this oid; shutdown if this firmware has no such bus. */
struct register_bus register_bus_lookup(uint8_t type, uint8_t oid);

/* Task: read from register `reg` on; `spi_flags` and `i2c_flags` are what the
 * chip wants to see above the address.  False if it did not answer. */
struct register_flags {
    uint8_t spi, i2c;
};
bool register_bus_read(const struct register_bus *bus, uint8_t reg,
                       struct register_flags flags, uint8_t len,
                       uint8_t *data);

#endif
