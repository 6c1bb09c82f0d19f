/* SPDX-License-Identifier: GPL-3.0-or-later
 * Devices on an SPI bus, of the chip or in software, with their chip select.
 */
#ifndef BUS_SPI_DEVICE_H
#define BUS_SPI_DEVICE_H

#include <stdbool.h>
#include <stdint.h>
#include "board/gpio.h"

struct spi_device;

/* Task: the object of config_spi. */
struct spi_device *spi_device_lookup(uint8_t oid);

/* Task: select, exchange `len` bytes, deselect; `data` becomes the answer if
 * receive_data.  Shutdown if the device has no bus yet. */
void spi_device_transfer(const struct spi_device *device,
                         uint8_t receive_data, uint8_t len, uint8_t *data);

/* Any context: whether there is a chip select; and drive it. */
bool spi_device_has_select(const struct spi_device *device);
void spi_device_select(const struct spi_device *device, bool is_active);

#endif
