/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPI and I2C of the simulated mcu: the world answers at once. */
#include "board/i2c.h"
#include "board/spi.h"
#include "core/sched.h"
#include "world.h"

DECL_ENUMERATION_RANGE("spi_bus", "spi0", 0, 8);
DECL_ENUMERATION_RANGE("i2c_bus", "i2c0", 0, 8);

struct spi_config spi_setup(uint32_t bus, uint8_t mode, uint32_t rate)
{
    (void)rate;
    if (bus >= SIMULATOR_BUSES || mode > 3)
        shutdown("Invalid spi bus");
    return (struct spi_config){ (uint8_t)bus };
}

void spi_prepare(struct spi_config config)
{
    (void)config;
}

void spi_transfer(struct spi_config config, uint8_t receive_data, uint8_t len,
                  uint8_t *data)
{
    uint8_t copy[UINT8_MAX];

    for (uint8_t i = 0; i < len; i++)
        copy[i] = data[i];
    simulator.host->spi(simulator.host->ctx, simulator_clock(), config.bus,
                        copy, len);
    for (uint8_t i = 0; receive_data && i < len; i++)
        data[i] = copy[i];
}

struct i2c_config i2c_setup(uint32_t bus, uint32_t rate, uint8_t addr)
{
    (void)rate;
    if (bus >= SIMULATOR_BUSES || addr > 0x7f)
        shutdown("Unsupported i2c bus");
    return (struct i2c_config){ (uint8_t)bus, addr };
}

enum i2c_result i2c_transfer(struct i2c_config config, uint8_t write_len,
                             const uint8_t *write, uint8_t read_len,
                             uint8_t *read)
{
    int32_t result = simulator.host->i2c(
        simulator.host->ctx, simulator_clock(), config.bus, config.addr,
        write, write_len, read, read_len);

    return result ? I2C_NACK : I2C_OK;
}
