/* SPDX-License-Identifier: GPL-3.0-or-later
 * Registers of a chip behind SPI or I2C. */
#include <string.h>

#include "bus/i2c_device.h"
#include "bus/spi_device.h"
#include "core/sched.h"
#include "sensors/register_bus.h"

DECL_ENUMERATION("bus_oid_type", "spi", 0);
DECL_ENUMERATION("bus_oid_type", "i2c", 1);

struct register_bus register_bus_lookup(uint8_t type, uint8_t oid)
{
    struct register_bus bus = { .type = type };

    if (type > REGISTER_BUS_I2C)
        shutdown("bus_type invalid");
#if CONFIG_NEED_SPI_DEVICE
    if (type == REGISTER_BUS_SPI)
        bus.device = spi_device_lookup(oid);
#else
    if (type == REGISTER_BUS_SPI)
        shutdown("bus_type spi unsupported");
#endif
#if CONFIG_NEED_I2C_DEVICE
    if (type == REGISTER_BUS_I2C)
        bus.device = i2c_device_lookup(oid);
#else
    if (type == REGISTER_BUS_I2C)
        shutdown("bus_type i2c unsupported");
#endif
    return bus;
}

#if CONFIG_NEED_SPI_DEVICE
static bool read_spi(const struct register_bus *bus, uint8_t address,
                     uint8_t len, uint8_t *data)
{
    uint8_t buffer[1 + REGISTER_BUS_READ_MAX] = { address };

    spi_device_transfer(bus->device, 1, (uint8_t)(len + 1), buffer);
    memcpy(data, buffer + 1, len);
    return true;
}
#endif

bool register_bus_read(const struct register_bus *bus, uint8_t reg,
                       struct register_flags flags, uint8_t len,
                       uint8_t *data)
{
#if CONFIG_NEED_SPI_DEVICE
    if (bus->type == REGISTER_BUS_SPI)
        return read_spi(bus, reg | flags.spi, len, data);
#endif
#if CONFIG_NEED_I2C_DEVICE
    if (bus->type == REGISTER_BUS_I2C)
        return i2c_device_read(bus->device, reg | flags.i2c, len, data)
               == I2C_OK;
#endif
    return false;
}
