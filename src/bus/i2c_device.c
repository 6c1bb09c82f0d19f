/* SPDX-License-Identifier: GPL-3.0-or-later
 * Devices on an I2C bus. */
#include "bus/i2c_device.h"
#include "bus/i2c_software.h"
#include "core/oid.h"
#include "core/sched.h"

enum i2c_device_bus { BUS_NONE, BUS_HARDWARE, BUS_SOFTWARE };
enum { READ_MAX = 52 }; /* what fits into a message */

DECL_ENUMERATION("i2c_bus_status", "SUCCESS", 0);
DECL_ENUMERATION("i2c_bus_status", "NACK", 1);
DECL_ENUMERATION("i2c_bus_status", "START_NACK", 2);
DECL_ENUMERATION("i2c_bus_status", "START_READ_NACK", 3);
DECL_ENUMERATION("i2c_bus_status", "BUS_TIMEOUT", 4);
_Static_assert(I2C_OK == 0 && I2C_NACK == 1 && I2C_START_NACK == 2
               && I2C_START_READ_NACK == 3 && I2C_TIMEOUT == 4,
               "i2c_bus_status is enum i2c_result");

struct i2c_device {
    uint8_t bus;
    union {
#if CONFIG_WANT_I2C
        struct i2c_config hardware;
#endif
        struct i2c_software software;
    };
};

static const ROM struct oid_kind i2c_device_kind = {
    sizeof(struct i2c_device)
};

struct i2c_device *i2c_device_lookup(uint8_t oid)
{
    return oid_lookup(oid, &i2c_device_kind);
}

void command_config_i2c(const struct args_config_i2c *args)
{
    oid_new(args->oid, &i2c_device_kind);
}
DECL_COMMAND(command_config_i2c, "config_i2c oid=%c");

static struct i2c_device *lookup_without_bus(uint8_t oid, uint32_t address)
{
    struct i2c_device *device = i2c_device_lookup(oid);

    if (device->bus != BUS_NONE || address > 0x7f)
        shutdown("Invalid i2c config");
    return device;
}

#if CONFIG_WANT_I2C
void command_i2c_set_bus(const struct args_i2c_set_bus *args)
{
    struct i2c_device *device = lookup_without_bus(args->oid, args->address);

    device->hardware = i2c_setup(args->i2c_bus, args->rate,
                                 (uint8_t)args->address);
    device->bus = BUS_HARDWARE;
}
DECL_COMMAND(command_i2c_set_bus,
             "i2c_set_bus oid=%c i2c_bus=%u rate=%u address=%u");
#endif

#if CONFIG_WANT_SOFTWARE_I2C
void command_i2c_set_sw_bus(const struct args_i2c_set_sw_bus *args)
{
    struct i2c_device *device = lookup_without_bus(args->oid, args->address);

    device->software = i2c_software_setup(
        args->scl_pin, args->sda_pin, args->pulse_ticks,
        (uint8_t)args->address);
    device->bus = BUS_SOFTWARE;
}
DECL_COMMAND(command_i2c_set_sw_bus,
             "i2c_set_sw_bus oid=%c scl_pin=%u sda_pin=%u pulse_ticks=%u"
             " address=%u");
#endif

enum i2c_result i2c_device_transfer(const struct i2c_device *device,
                                    uint8_t write_len, const uint8_t *write,
                                    uint8_t read_len, uint8_t *read)
{
#if CONFIG_WANT_I2C
    if (device->bus == BUS_HARDWARE)
        return i2c_transfer(device->hardware, write_len, write, read_len,
                            read);
#endif
#if CONFIG_WANT_SOFTWARE_I2C
    if (device->bus == BUS_SOFTWARE)
        return i2c_software_transfer(&device->software, write_len, write,
                                     read_len, read);
#endif
    shutdown("Invalid i2c config");
}

enum i2c_result i2c_device_read(const struct i2c_device *device, uint8_t reg,
                                uint8_t len, uint8_t *data)
{
    return i2c_device_transfer(device, 1, &reg, len, data);
}

/* What went wrong is for the host to judge. */
void command_i2c_transfer(const struct args_i2c_transfer *args)
{
    struct i2c_device *device = i2c_device_lookup(args->oid);
    uint8_t data[READ_MAX], len = (uint8_t)args->read_len;
    enum i2c_result result;

    if (args->read_len > READ_MAX)
        shutdown("Invalid i2c read length");
    result = i2c_device_transfer(device, args->write_len, args->write, len,
                                 data);
    sendf("i2c_response oid=%c i2c_bus_status=%c response=%*s", args->oid,
          (uint8_t)result, result == I2C_OK ? len : 0, data);
}
DECL_COMMAND(command_i2c_transfer, "i2c_transfer oid=%c write=%*s read_len=%u");
