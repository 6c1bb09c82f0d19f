/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPI masters (UM10360, chapter 17). */
#include "board/spi.h"
#include "chip.h"
#include "core/sched.h"

DECL_ENUMERATION("spi_bus", "ssp0", 0);
DECL_CONSTANT_STR("BUS_PINS_ssp0", "P0.17,P0.18,P0.15");
DECL_ENUMERATION("spi_bus", "ssp1", 1);
DECL_CONSTANT_STR("BUS_PINS_ssp1", "P0.8,P0.9,P0.7");

#define PINS_FUNCTION 2

static const struct {
    struct ssp_regs *regs;
    uint8_t power, miso, mosi, sclk;
} buses[] = {
    { (struct ssp_regs *)SSP0_BASE, SSP0_POWER, GPIO(0, 17), GPIO(0, 18),
      GPIO(0, 15) },
    { (struct ssp_regs *)SSP1_BASE, SSP1_POWER, GPIO(0, 8), GPIO(0, 9),
      GPIO(0, 7) },
};

/* The clock is divided by an even number up to 254, then by 1 to 256. */
static struct spi_config make_config(struct ssp_regs *regs, uint8_t mode,
                                     uint32_t rate)
{
    uint32_t divider = 2, rest;

    if (!rate)
        rate = 1;
    while (divider < 254 && CONFIG_CLOCK_FREQ / divider / 256 >= rate)
        divider += 2;
    rest = (CONFIG_CLOCK_FREQ + divider * rate - 1) / (divider * rate);
    if (rest > 256)
        rest = 256;
    return (struct spi_config) {
        regs, SSP_CR0_8_BITS | SSP_CR0_SCR(rest - 1)
            | (mode & 2 ? SSP_CR0_CPOL : 0) | (mode & 1 ? SSP_CR0_CPHA : 0),
        divider
    };
}

struct spi_config spi_setup(uint32_t bus, uint8_t mode, uint32_t rate)
{
    if (bus >= sizeof(buses) / sizeof(buses[0]))
        shutdown("Invalid spi bus");
    chip_enable(buses[bus].power);
    gpio_alternate(buses[bus].miso, PINS_FUNCTION, 1);
    gpio_alternate(buses[bus].mosi, PINS_FUNCTION, 0);
    gpio_alternate(buses[bus].sclk, PINS_FUNCTION, 0);
    return make_config(buses[bus].regs, mode, rate);
}

void spi_prepare(struct spi_config config)
{
    struct ssp_regs *regs = config.regs;

    if (regs->CR0 == config.cr0 && regs->CPSR == config.prescaler
        && regs->CR1 & SSP_CR1_SSE)
        return;
    regs->CR1 = 0;
    regs->CR0 = config.cr0;
    regs->CPSR = config.prescaler;
    regs->CR1 = SSP_CR1_SSE;
}

void spi_transfer(struct spi_config config, uint8_t receive_data,
                  uint8_t len, uint8_t *data)
{
    struct ssp_regs *regs = config.regs;

    while (len--) {
        uint8_t byte;

        regs->DR = *data;
        while (!(regs->SR & SSP_SR_RNE))
            ;
        byte = (uint8_t)regs->DR;
        if (receive_data)
            *data = byte;
        data++;
    }
    while (regs->SR & SSP_SR_BSY)
        ;
}
