/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: SPI masters.  port.h defines struct spi_config.
 *
 * The port declares its buses: DECL_ENUMERATION("spi_bus", "<name>", n) and,
 * where they are fixed, DECL_CONSTANT_STR("BUS_PINS_<name>", "miso,mosi,sclk").
 * Chip select is the core's business (a gpio).
 */
#ifndef BOARD_SPI_H
#define BOARD_SPI_H

#include <stdint.h>
#include "port.h"

/* --- The port provides --- */

/* Task: settings for one device; mode 0..3, rate in Hz (an upper bound).
 * shutdown("Invalid spi bus") if there is no such bus. */
struct spi_config spi_setup(uint32_t bus, uint8_t mode, uint32_t rate);

/* Task: give the bus this device's settings; call before its chip select. */
void spi_prepare(struct spi_config config);

/* Task or irq: exchange `len` bytes; `data` keeps the answer if
 * receive_data.  Blocks for the transfer: 8 * len bit times. */
void spi_transfer(struct spi_config config, uint8_t receive_data,
                  uint8_t len, uint8_t *data);

#endif
