/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPI masters (RM0008, 25.3; RM0091, 28.5; RM0433, 50.4). */
#include "board/spi.h"
#include "chip.h"
#include "core/sched.h"
#include "spi_buses.h"

struct spi_bus {
    uint8_t number, miso, mosi, sclk;
    uint16_t functions;
};
#define X(NUMBER, MISO, MOSI, SCLK, FUNCTIONS) \
    { NUMBER, MISO, MOSI, SCLK, FUNCTIONS },
static const struct spi_bus buses[] = { SPI_BUSES };
#undef X
#define N_BUSES (sizeof(buses) / sizeof(buses[0]))

static const struct {
    spi_regs_t *regs;
    uint16_t gate;
} units[] = {
    { (spi_regs_t *)SPI1_BASE, SPI1_GATE },
    { (spi_regs_t *)SPI2_BASE, SPI2_GATE },
#ifdef SPI3_BASE
    { (spi_regs_t *)SPI3_BASE, SPI3_GATE },
#endif
#ifdef SPI4_BASE
    { (spi_regs_t *)SPI4_BASE, SPI4_GATE },
    { (spi_regs_t *)SPI5_BASE, SPI5_GATE },
    { (spi_regs_t *)SPI6_BASE, SPI6_GATE },
#endif
};

/* Least power of two above one that brings `hz` to `rate`; its exponent - 1. */
static uint32_t find_divider(uint32_t hz, uint32_t rate)
{
    uint32_t divider = 0;

    while (divider < 7 && (hz >> (divider + 1)) > rate)
        divider++;
    return divider;
}

static void connect(const struct spi_bus *bus)
{
#if CONFIG_MACH_STM32F1
    if (bus->number == 1)
        gpio_remap(1, bus->functions);
#endif
    gpio_alternate(bus->miso, (bus->functions >> 8) & 15, 1);
    gpio_alternate(bus->mosi, (bus->functions >> 4) & 15, 0);
    gpio_alternate(bus->sclk, bus->functions & 15, 0);
}

#if CONFIG_MACH_STM32H7
/* Configuration words: CFG1, and CFG2 */
static struct spi_config make_config(spi_regs_t *regs, uint8_t mode,
                                     uint32_t divider)
{
    return (struct spi_config) {
        regs, SPI_CFG1_8_BITS | SPI_CFG1_MBR(divider),
        SPI_CFG2_MASTER | SPI_CFG2_SSM | SPI_CFG2_AFCNTR
            | (mode & 1 ? SPI_CFG2_CPHA : 0) | (mode & 2 ? SPI_CFG2_CPOL : 0)
    };
}

void spi_prepare(struct spi_config config)
{
    config.regs->CR1 = SPI_CR1_SSI;
    config.regs->CFG1 = config.first;
    config.regs->CFG2 = config.second;
}

void spi_transfer(struct spi_config config, uint8_t receive_data,
                  uint8_t len, uint8_t *data)
{
    spi_regs_t *regs = config.regs;
    uint32_t sent = 0, received = 0;

    regs->CR2 = len;
    regs->CR1 = SPI_CR1_SSI | SPI_CR1_SPE;
    regs->CR1 = SPI_CR1_SSI | SPI_CR1_SPE | SPI_CR1_CSTART;
    while (received < len) {
        uint32_t status = regs->SR;

        if (status & SPI_SR_TXP && sent < len)
            *(volatile uint8_t *)&regs->TXDR = data[sent++];
        if (status & SPI_SR_RXP) {
            uint8_t byte = *(volatile uint8_t *)&regs->RXDR;

            if (receive_data)
                data[received] = byte;
            received++;
        }
    }
    while (!(regs->SR & SPI_SR_EOT))
        ;
    regs->IFCR = SPI_IFCR_EOT | SPI_IFCR_TXTF;
    regs->CR1 = SPI_CR1_SSI;
}
#else
/* Configuration words: CR1, and CR2 */
static struct spi_config make_config(spi_regs_t *regs, uint8_t mode,
                                     uint32_t divider)
{
    return (struct spi_config) {
        regs, (uint32_t)mode | SPI_CR1_MSTR | SPI_CR1_BR(divider) | SPI_CR1_SPE
            | SPI_CR1_SSI | SPI_CR1_SSM,
        CONFIG_STM32_USART_V2 ? SPI_CR2_8_BITS | SPI_CR2_FRXTH : 0
    };
}

void spi_prepare(struct spi_config config)
{
    spi_regs_t *regs = config.regs;

    if (regs->CR1 == config.first)
        return;
    regs->CR1 = config.first & ~SPI_CR1_SPE;
    regs->CR2 = config.second;
    regs->CR1 = config.first;
}

void spi_transfer(struct spi_config config, uint8_t receive_data,
                  uint8_t len, uint8_t *data)
{
    spi_regs_t *regs = config.regs;

    while (len--) {
        uint8_t byte;

        *(volatile uint8_t *)&regs->DR = *data;
        while (!(regs->SR & SPI_SR_RXNE))
            ;
        byte = *(volatile uint8_t *)&regs->DR;
        if (receive_data)
            *data = byte;
        data++;
    }
    while (regs->SR & SPI_SR_BSY)
        ;
}
#endif

struct spi_config spi_setup(uint32_t bus, uint8_t mode, uint32_t rate)
{
    const struct spi_bus *b = &buses[bus];

    if (bus >= N_BUSES || !b->number)
        shutdown("Invalid spi bus");
#if CONFIG_MACH_STM32H7
    RCC->D2CCIP1R = RCC_D2CCIP1R_SPI123_PER;
#endif
    chip_enable(units[b->number - 1].gate);
    connect(b);
    return make_config(units[b->number - 1].regs, mode,
                       find_divider(SPI_HZ(b->number), rate));
}
