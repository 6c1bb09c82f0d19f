/* SPDX-License-Identifier: GPL-3.0-or-later
 * Devices on an SPI bus. */
#include <string.h>

#include "bus/spi_device.h"
#include "bus/spi_software.h"
#include "core/arena.h"
#include "core/command.h"
#include "core/oid.h"
#include "core/sched.h"
#if CONFIG_WANT_SPI
#include "board/spi.h"
#endif

enum spi_device_bus { BUS_NONE, BUS_HARDWARE, BUS_SOFTWARE };

struct spi_device {
    uint8_t bus;
    bool has_select, select_level;
    struct gpio_out select;
    union {
#if CONFIG_WANT_SPI
        struct spi_config hardware;
#endif
        struct spi_software software;
    };
};

/* What a device must be told when the mcu shuts down. */
struct spi_farewell {
    const struct spi_device *device;
    uint8_t len;
    uint8_t *data;
};

static const ROM struct oid_kind spi_device_kind = {
    sizeof(struct spi_device)
};
static const ROM struct oid_kind spi_farewell_kind = {
    sizeof(struct spi_farewell)
};

struct spi_device *spi_device_lookup(uint8_t oid)
{
    return oid_lookup(oid, &spi_device_kind);
}

bool spi_device_has_select(const struct spi_device *device)
{
    return device->has_select;
}

void spi_device_select(const struct spi_device *device, bool is_active)
{
    if (device->has_select)
        gpio_write(device->select, is_active == device->select_level);
}


/* ---- Configuration ---- */

void command_config_spi(const struct args_config_spi *args)
{
    bool level = args->cs_active_high != 0;
    struct gpio_out select = gpio_setup_output(args->pin, !level);
    struct spi_device *device = oid_new(args->oid, &spi_device_kind);

    device->select = select;
    device->has_select = true;
    device->select_level = level;
}
DECL_COMMAND(command_config_spi, "config_spi oid=%c pin=%u cs_active_high=%c");

void command_config_spi_without_cs(
    const struct args_config_spi_without_cs *args)
{
    oid_new(args->oid, &spi_device_kind);
}
DECL_COMMAND(command_config_spi_without_cs, "config_spi_without_cs oid=%c");

static struct spi_device *lookup_without_bus(uint8_t oid, uint32_t mode)
{
    struct spi_device *device = spi_device_lookup(oid);

    if (device->bus != BUS_NONE || mode > 3)
        shutdown("Invalid spi config");
    return device;
}

#if CONFIG_WANT_SPI
void command_spi_set_bus(const struct args_spi_set_bus *args)
{
    struct spi_device *device = lookup_without_bus(args->oid, args->mode);

    device->hardware = spi_setup(args->spi_bus, (uint8_t)args->mode,
                                 args->rate);
    device->bus = BUS_HARDWARE;
}
DECL_COMMAND(command_spi_set_bus,
             "spi_set_bus oid=%c spi_bus=%u mode=%u rate=%u");
#endif

#if CONFIG_WANT_SOFTWARE_SPI
void command_spi_set_sw_bus(const struct args_spi_set_sw_bus *args)
{
    struct spi_device *device = lookup_without_bus(args->oid, args->mode);

    device->software.mode = (uint8_t)args->mode;
    device->software.pulse_ticks = args->pulse_ticks;
    device->software.miso = gpio_setup_input(args->miso_pin, 1);
    device->software.mosi = gpio_setup_output(args->mosi_pin, 0);
    device->software.sclk = gpio_setup_output(args->sclk_pin,
                                              device->software.mode >> 1);
    device->bus = BUS_SOFTWARE;
}
DECL_COMMAND(command_spi_set_sw_bus,
             "spi_set_sw_bus oid=%c miso_pin=%u mosi_pin=%u sclk_pin=%u"
             " mode=%u pulse_ticks=%u");
#endif


/* ---- Transfers ---- */

static void prepare(const struct spi_device *device)
{
#if CONFIG_WANT_SPI
    if (device->bus == BUS_HARDWARE)
        spi_prepare(device->hardware);
#endif
#if CONFIG_WANT_SOFTWARE_SPI
    if (device->bus == BUS_SOFTWARE)
        spi_software_prepare(&device->software);
#endif
}

static void exchange(const struct spi_device *device, uint8_t receive_data,
                     uint8_t len, uint8_t *data)
{
#if CONFIG_WANT_SPI
    if (device->bus == BUS_HARDWARE)
        spi_transfer(device->hardware, receive_data, len, data);
#endif
#if CONFIG_WANT_SOFTWARE_SPI
    if (device->bus == BUS_SOFTWARE)
        spi_software_transfer(&device->software, receive_data, len, data);
#endif
}

void spi_device_transfer(const struct spi_device *device,
                         uint8_t receive_data, uint8_t len, uint8_t *data)
{
    if (device->bus == BUS_NONE)
        shutdown("Invalid spi config");
    prepare(device);
    spi_device_select(device, true);
    exchange(device, receive_data, len, data);
    spi_device_select(device, false);
}

void command_spi_transfer(const struct args_spi_transfer *args)
{
    struct spi_device *device = spi_device_lookup(args->oid);
    uint8_t data[COMMAND_PAYLOAD_MAX];

    memcpy(data, args->data, args->data_len);
    spi_device_transfer(device, 1, args->data_len, data);
    sendf("spi_transfer_response oid=%c response=%*s", args->oid,
          args->data_len, data);
}
DECL_COMMAND(command_spi_transfer, "spi_transfer oid=%c data=%*s");

void command_spi_send(const struct args_spi_send *args)
{
    struct spi_device *device = spi_device_lookup(args->oid);
    uint8_t data[COMMAND_PAYLOAD_MAX];

    memcpy(data, args->data, args->data_len);
    spi_device_transfer(device, 0, args->data_len, data);
}
DECL_COMMAND(command_spi_send, "spi_send oid=%c data=%*s");


/* ---- Shutdown ---- */

void command_config_spi_shutdown(const struct args_config_spi_shutdown *args)
{
    struct spi_device *device = spi_device_lookup(args->spi_oid);
    struct spi_farewell *farewell = oid_new(args->oid, &spi_farewell_kind);

    farewell->device = device;
    farewell->data = arena_alloc(args->shutdown_msg_len);
    memcpy(farewell->data, args->shutdown_msg, args->shutdown_msg_len);
    farewell->len = args->shutdown_msg_len;
}
DECL_COMMAND(command_config_spi_shutdown,
             "config_spi_shutdown oid=%c spi_oid=%c shutdown_msg=%*s");

/* A transfer may have been broken off: first everybody lets go of the bus. */
void spi_device_shutdown(void)
{
    struct spi_device *device;
    struct spi_farewell *farewell;
    int16_t oid = -1;

    while ((device = oid_next(&oid, &spi_device_kind)))
        spi_device_select(device, false);
    oid = -1;
    while ((farewell = oid_next(&oid, &spi_farewell_kind)))
        if (farewell->device->bus != BUS_NONE)
            spi_device_transfer(farewell->device, 0, farewell->len,
                                farewell->data);
}
DECL_SHUTDOWN(spi_device_shutdown);
