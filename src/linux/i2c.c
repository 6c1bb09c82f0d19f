/* SPDX-License-Identifier: GPL-3.0-or-later
 * I2C buses.  Their speed is the system's choice (device tree). */
#include <errno.h>

#include "board/i2c.h"
#include "core/sched.h"
#include "devices.h"

#define BUSES 15

DECL_ENUMERATION_RANGE("i2c_bus", "i2c.0", 0, BUSES);

struct i2c_bus {
    int handle;
    bool is_open;
};

static struct i2c_bus buses[BUSES];

struct i2c_config i2c_setup(uint32_t number, uint32_t rate, uint8_t addr)
{
    struct i2c_bus *bus;

    (void)rate;
    if (number >= BUSES || addr > 0x7f)
        shutdown("Unsupported i2c bus");
    bus = &buses[number];
    if (!bus->is_open)
        bus->handle = devices.i2c->open(number);
    bus->is_open = bus->handle >= 0;
    if (!bus->is_open)
        shutdown("Unsupported i2c bus");
    return (struct i2c_config){ bus, addr };
}

/* Adapters say "nobody there" in two ways, and do not say at which byte. */
static enum i2c_result read_error(int error, uint8_t write_len)
{
    if (error == -ENXIO || error == -EREMOTEIO)
        return write_len ? I2C_START_NACK : I2C_START_READ_NACK;
    if (error == -ETIMEDOUT || error == -EAGAIN || error == -EBUSY)
        return I2C_TIMEOUT;
    return I2C_NACK;
}

enum i2c_result i2c_transfer(struct i2c_config config, uint8_t write_len,
                             const uint8_t *write, uint8_t read_len,
                             uint8_t *read)
{
    int result;

    if (!write_len && !read_len)
        return I2C_OK;
    result = devices.i2c->transfer(config.bus->handle, config.addr, write_len,
                                   write, read_len, read);
    return result < 0 ? read_error(result, write_len) : I2C_OK;
}
