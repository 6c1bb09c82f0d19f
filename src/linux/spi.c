/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPI: one bus a spidev device, which brings its own chip select. */
#include <stddef.h>

#include "board/spi.h"
#include "core/sched.h"
#include "devices.h"

#define SELECTS 16 /* a bus */
#define BUSES 8

DECL_ENUMERATION_RANGE("spi_bus", "spidev0.0", 0 * SELECTS, SELECTS);
DECL_ENUMERATION_RANGE("spi_bus", "spidev1.0", 1 * SELECTS, SELECTS);
DECL_ENUMERATION_RANGE("spi_bus", "spidev2.0", 2 * SELECTS, SELECTS);
DECL_ENUMERATION_RANGE("spi_bus", "spidev3.0", 3 * SELECTS, SELECTS);
DECL_ENUMERATION_RANGE("spi_bus", "spidev4.0", 4 * SELECTS, SELECTS);
DECL_ENUMERATION_RANGE("spi_bus", "spidev5.0", 5 * SELECTS, SELECTS);
DECL_ENUMERATION_RANGE("spi_bus", "spidev6.0", 6 * SELECTS, SELECTS);
DECL_ENUMERATION_RANGE("spi_bus", "spidev7.0", 7 * SELECTS, SELECTS);

struct spi_bus {
    int handle;
    bool is_open;
    int16_t mode; /* that the device has now; -1: unknown */
};

static struct spi_bus buses[BUSES * SELECTS];

struct spi_config spi_setup(uint32_t number, uint8_t mode, uint32_t rate)
{
    struct spi_bus *bus;

    if (number >= BUSES * SELECTS || mode > 3)
        shutdown("Invalid spi bus");
    bus = &buses[number];
    if (!bus->is_open) {
        bus->handle = devices.spi->open(number / SELECTS, number % SELECTS);
        bus->is_open = bus->handle >= 0;
        bus->mode = -1;
    }
    if (!bus->is_open)
        shutdown("Invalid spi bus");
    return (struct spi_config){ bus, rate, mode };
}

void spi_prepare(struct spi_config config)
{
    if (config.bus->mode == config.mode)
        return;
    if (devices.spi->set_mode(config.bus->handle, config.mode) < 0)
        shutdown("Spi mode cannot be set");
    config.bus->mode = config.mode;
}

void spi_transfer(struct spi_config config, uint8_t receive_data, uint8_t len,
                  uint8_t *data)
{
    if (!len)
        return;
    if (devices.spi->transfer(config.bus->handle, config.rate, data,
                              receive_data ? data : NULL, len) < 0)
        try_shutdown("Spi transfer failed");
}
