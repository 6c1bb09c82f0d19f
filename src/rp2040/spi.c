/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPI masters (data sheet, 4.4). */
#include "board/spi.h"
#include "chip.h"
#include "core/sched.h"

/* By the names that configs use: receive, transmit, clock */
DECL_ENUMERATION("spi_bus", "spi0_gpio0_gpio3_gpio2", 0);
DECL_CONSTANT_STR("BUS_PINS_spi0_gpio0_gpio3_gpio2", "gpio0,gpio3,gpio2");
DECL_ENUMERATION("spi_bus", "spi0_gpio4_gpio7_gpio6", 1);
DECL_CONSTANT_STR("BUS_PINS_spi0_gpio4_gpio7_gpio6", "gpio4,gpio7,gpio6");
DECL_ENUMERATION("spi_bus", "spi0_gpio16_gpio19_gpio18", 2);
DECL_CONSTANT_STR("BUS_PINS_spi0_gpio16_gpio19_gpio18",
                  "gpio16,gpio19,gpio18");
DECL_ENUMERATION("spi_bus", "spi0_gpio20_gpio23_gpio22", 3);
DECL_CONSTANT_STR("BUS_PINS_spi0_gpio20_gpio23_gpio22",
                  "gpio20,gpio23,gpio22");
DECL_ENUMERATION("spi_bus", "spi0_gpio4_gpio3_gpio2", 4);
DECL_CONSTANT_STR("BUS_PINS_spi0_gpio4_gpio3_gpio2", "gpio4,gpio3,gpio2");
DECL_ENUMERATION("spi_bus", "spi1_gpio8_gpio11_gpio10", 5);
DECL_CONSTANT_STR("BUS_PINS_spi1_gpio8_gpio11_gpio10", "gpio8,gpio11,gpio10");
DECL_ENUMERATION("spi_bus", "spi1_gpio12_gpio15_gpio14", 6);
DECL_CONSTANT_STR("BUS_PINS_spi1_gpio12_gpio15_gpio14",
                  "gpio12,gpio15,gpio14");
DECL_ENUMERATION("spi_bus", "spi1_gpio24_gpio27_gpio26", 7);
DECL_CONSTANT_STR("BUS_PINS_spi1_gpio24_gpio27_gpio26",
                  "gpio24,gpio27,gpio26");
DECL_ENUMERATION("spi_bus", "spi1_gpio12_gpio11_gpio10", 8);
DECL_CONSTANT_STR("BUS_PINS_spi1_gpio12_gpio11_gpio10",
                  "gpio12,gpio11,gpio10");
/* Older names */
DECL_ENUMERATION("spi_bus", "spi0a", 0);
DECL_CONSTANT_STR("BUS_PINS_spi0a", "gpio0,gpio3,gpio2");
DECL_ENUMERATION("spi_bus", "spi0b", 1);
DECL_CONSTANT_STR("BUS_PINS_spi0b", "gpio4,gpio7,gpio6");
DECL_ENUMERATION("spi_bus", "spi0c", 2);
DECL_CONSTANT_STR("BUS_PINS_spi0c", "gpio16,gpio19,gpio18");
DECL_ENUMERATION("spi_bus", "spi0d", 3);
DECL_CONSTANT_STR("BUS_PINS_spi0d", "gpio20,gpio23,gpio22");
DECL_ENUMERATION("spi_bus", "spi1a", 5);
DECL_CONSTANT_STR("BUS_PINS_spi1a", "gpio8,gpio11,gpio10");
DECL_ENUMERATION("spi_bus", "spi1b", 6);
DECL_CONSTANT_STR("BUS_PINS_spi1b", "gpio12,gpio15,gpio14");
DECL_ENUMERATION("spi_bus", "spi1c", 7);
DECL_CONSTANT_STR("BUS_PINS_spi1c", "gpio24,gpio27,gpio26");

/* Pins are of one bus or the other by eights */
static const struct { uint8_t miso, mosi, sclk; } buses[] = {
    { 0, 3, 2 }, { 4, 7, 6 }, { 16, 19, 18 }, { 20, 23, 22 }, { 4, 3, 2 },
    { 8, 11, 10 }, { 12, 15, 14 }, { 24, 27, 26 }, { 12, 11, 10 },
};
#define N_BUSES (sizeof(buses) / sizeof(buses[0]))

/* rate = clock / (even prescaler * (1 + divider)) */
static struct spi_config make_config(struct spi_regs *regs, uint8_t mode,
                                     uint32_t rate)
{
    uint32_t ratio = (SYS_FREQ + rate - 1) / (rate ? rate : 1);
    uint32_t prescaler = (ratio + 255) / 256, divider;

    prescaler += prescaler & 1;
    prescaler = prescaler < 2 ? 2 : prescaler > 254 ? 254 : prescaler;
    divider = (ratio + prescaler - 1) / prescaler;
    divider = divider < 1 ? 1 : divider > 256 ? 256 : divider;
    return (struct spi_config) {
        regs, SPI_CR0_8_BITS | SPI_CR0_SCR(divider - 1)
            | (mode & 1 ? SPI_CR0_SPH : 0) | (mode & 2 ? SPI_CR0_SPO : 0),
        prescaler
    };
}

struct spi_config spi_setup(uint32_t bus, uint8_t mode, uint32_t rate)
{
    bool is_spi1;
    struct spi_config config;

    if (bus >= N_BUSES)
        shutdown("Invalid spi bus");
    is_spi1 = buses[bus].miso / 8 % 2;
    chip_enable(is_spi1 ? RESET_SPI1 : RESET_SPI0);
    config = make_config((struct spi_regs *)(is_spi1 ? SPI1_BASE : SPI0_BASE),
                         mode, rate);
    spi_prepare(config);
    gpio_function(buses[bus].miso, IO_SPI, 1);
    gpio_function(buses[bus].mosi, IO_SPI, 0);
    gpio_function(buses[bus].sclk, IO_SPI, 0);
    return config;
}

void spi_prepare(struct spi_config config)
{
    struct spi_regs *regs = config.regs;

    if (regs->CR0 == config.cr0 && regs->CPSR == config.prescaler)
        return;
    regs->CR1 = 0;
    regs->CPSR = config.prescaler;
    regs->CR0 = config.cr0;
    regs->CR1 = SPI_CR1_SSE;
}

void spi_transfer(struct spi_config config, uint8_t receive_data,
                  uint8_t len, uint8_t *data)
{
    struct spi_regs *regs = config.regs;

    while (len--) {
        uint8_t byte;

        regs->DR = *data;
        while (!(regs->SR & SPI_SR_RNE))
            ;
        byte = (uint8_t)regs->DR;
        if (receive_data)
            *data = byte;
        data++;
    }
    while (regs->SR & SPI_SR_BSY)
        ;
}
