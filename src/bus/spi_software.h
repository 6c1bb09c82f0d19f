/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPI on any pins, bit by bit.
 */
#ifndef BUS_SPI_SOFTWARE_H
#define BUS_SPI_SOFTWARE_H

#include <stdint.h>
#include "board/gpio.h"

struct spi_software {
    struct gpio_in miso;
    struct gpio_out mosi, sclk;
    uint32_t pulse_ticks;  /* between two edges of the clock, at least */
    uint8_t mode;          /* 0..3: 2 is the idle level, 1 the phase */
};

/* Task: the clock at this device's idle level; before its chip select. */
void spi_software_prepare(const struct spi_software *bus);

/* Task or irq: exchange `len` bytes, keep the answer if receive_data. */
void spi_software_transfer(const struct spi_software *bus,
                           uint8_t receive_data, uint8_t len, uint8_t *data);

#endif
