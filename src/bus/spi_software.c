/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPI on any pins, bit by bit. */
#include "board/delay.h"
#include "bus/spi_software.h"

enum { PHASE = 1, IDLE_HIGH = 2 };

static uint8_t idle_level(const struct spi_software *bus)
{
    return (bus->mode & IDLE_HIGH) != 0;
}

void spi_software_prepare(const struct spi_software *bus)
{
    gpio_write(bus->sclk, idle_level(bus));
}

/* Data is read at the first edge of the clock and changes at the second, or
 * with PHASE the other way round. */
static uint8_t exchange_byte(const struct spi_software *bus, uint8_t out)
{
    uint8_t idle = idle_level(bus), phase = bus->mode & PHASE, in = 0;

    for (uint8_t n_bits = 8; n_bits; n_bits--) {
        if (phase)
            gpio_write(bus->sclk, !idle);
        gpio_write(bus->mosi, out & 0x80);
        out = (uint8_t)(out << 1);
        delay_ticks(bus->pulse_ticks);
        gpio_write(bus->sclk, phase ? idle : !idle);
        in = (uint8_t)(in << 1 | gpio_read(bus->miso));
        delay_ticks(bus->pulse_ticks);
        if (!phase)
            gpio_write(bus->sclk, idle);
    }
    return in;
}

void spi_software_transfer(const struct spi_software *bus,
                           uint8_t receive_data, uint8_t len, uint8_t *data)
{
    for (; len; len--, data++) {
        uint8_t in = exchange_byte(bus, *data);
        if (receive_data)
            *data = in;
    }
}
