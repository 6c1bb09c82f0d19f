/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPI masters on SERCOM units (data sheets, SERCOM SPI). */
#include "board/spi.h"
#include "chip.h"
#include "core/sched.h"
#include "sercom.h"

/* DOPO by the pads of data and clock; 4: there is no such pair.  A D51 has the
 * pairs with the clock at pad 1. */
static uint32_t find_dopo(uint8_t tx, uint8_t clk)
{
    if (tx == 0 && clk == 1)
        return 0;
    if (tx == 3 && clk == 1)
        return 2;
    if (!CONFIG_MACH_SAMX5 && tx == 2 && clk == 3)
        return 1;
    return !CONFIG_MACH_SAMX5 && tx == 0 && clk == 3 ? 3 : 4;
}

struct spi_config spi_setup(uint32_t bus, uint8_t mode, uint32_t rate)
{
    struct spi_config config = { .regs = sercom_open(bus) };
    uint32_t dopo, divider;
    uint8_t tx, rx, clk;

    if (!config.regs)
        shutdown("Invalid spi bus");
    tx = sercom_connect_role(bus, SERCOM_TX, 0);
    rx = sercom_connect_role(bus, SERCOM_RX, 1);
    clk = sercom_connect_role(bus, SERCOM_CLK, 0);
    dopo = find_dopo(tx, clk);
    if (dopo > 3)
        shutdown("Invalid SERCOM configuration");
    if (rx == tx || rx == clk)
        shutdown("Sercom RX pad collides with TX or CLK pad");
    divider = (PERIPHERAL_HZ / 2 + rate - 1) / (rate ? rate : 1);
    divider = divider < 2 ? 2 : divider > 256 ? 256 : divider;
    config.baud = (uint8_t)(divider - 1);
    /* without a pin to receive, what comes at some pad is dropped */
    config.ctrla = SERCOM_CTRLA_MODE(SERCOM_MODE_SPI) | SERCOM_CTRLA_TXPO(dopo)
        | SERCOM_CTRLA_RXPO(rx > 3 ? (tx == 0 ? 2 : 0) : rx)
        | (mode & 1 ? SERCOM_CTRLA_CPHA : 0)
        | (mode & 2 ? SERCOM_CTRLA_CPOL : 0);
    spi_prepare(config);
    return config;
}

static void set_enabled(struct sercom_regs *regs, uint32_t ctrla)
{
    regs->CTRLA = ctrla;
    while (regs->SYNCBUSY)
        ;
}

void spi_prepare(struct spi_config config)
{
    struct sercom_regs *regs = config.regs;

    if (regs->CTRLA == (config.ctrla | SERCOM_CTRLA_ENABLE)
        && regs->BAUD8 == config.baud)
        return;
    set_enabled(regs, regs->CTRLA & ~SERCOM_CTRLA_ENABLE);
    regs->CTRLB = SERCOM_CTRLB_RXEN;
    regs->BAUD8 = config.baud;
    regs->CTRLA = config.ctrla;
    set_enabled(regs, config.ctrla | SERCOM_CTRLA_ENABLE);
}

void spi_transfer(struct spi_config config, uint8_t receive_data,
                  uint8_t len, uint8_t *data)
{
    struct sercom_regs *regs = config.regs;

    while (len--) {
        uint8_t byte;

        regs->DATA16 = *data;
        while (!(regs->INTFLAG & SERCOM_INT_RXC))
            ;
        byte = (uint8_t)regs->DATA16;
        if (receive_data)
            *data = byte;
        data++;
    }
}
