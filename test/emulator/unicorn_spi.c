/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * SPI of an STM32.
 */
#include "unicorn_chip.h"

/*
 * SPI: a byte takes eight bits' time; the world's bus is the number of the
 * peripheral.  An H7 counts the bytes of a transfer.
 */

enum { SPI_CR1 = 0, SPI_CR2 = 1, SPI_SR = 2, SPI_DR = 3,
       SPI_H7_CFG1 = 2, SPI_H7_CFG2 = 3, SPI_H7_SR = 5, SPI_H7_IFCR = 6,
       SPI_H7_TXDR = 8, SPI_H7_RXDR = 12 };
enum { SPI_RXNE = 1, SPI_TXE = 2, SPI_BSY = 0x80, SPI_EOT = 8 };

static bool
is_h7(void)
{
    return chip.model->line == LINE_H7;
}

/* A byte goes out; what comes in is there when its time has passed. */
static void
spi_send(struct device *d, uint32_t value)
{
    uint8_t byte = (uint8_t)value;
    uint32_t cr1 = d->regs[SPI_CR1], divider;
    bool is_on = is_h7() ? (cr1 & 0x201) == 0x201
        && d->regs[SPI_H7_CFG2] & (1u << 22) : (cr1 & 0x44) == 0x44;

    if (!is_on) {
        chip_fault("spi %u is no master, or off", d->info->index);
        return;
    }
    divider = is_h7() ? d->regs[SPI_H7_CFG1] >> 28 & 7 : cr1 >> 3 & 7;
    chip.host.spi(chip.host.ctx, chip_now(), d->info->index, &byte, 1);
    d->rx_data = byte;
    d->due = chip.cycle + (uint64_t)(16u << divider)
        * (chip.core_hz / chip.bus_hz[d->info->bus]);
    chip_wake_at(d->due);
}

void
spi_run_event(struct device *d)
{
    if (chip.cycle < d->due)
        return;
    d->due = NEVER;
    d->has_tdr = true;          /* here: something was received */
    d->shift++;
}

uint32_t
spi_read(struct device *d, uint32_t word)
{
    uint32_t status = (d->has_tdr ? SPI_RXNE : 0)
        | (d->due == NEVER && !d->has_tdr ? SPI_TXE : 0);

    if (is_h7() && word == SPI_H7_SR)
        return status | (d->shift >= d->regs[SPI_CR2] ? SPI_EOT : 0);
    if (!is_h7() && word == SPI_SR)
        return status | (d->due == NEVER ? 0 : SPI_BSY);
    if (word != (is_h7() ? SPI_H7_RXDR : SPI_DR))
        return d->regs[word];
    d->has_tdr = false;
    return d->rx_data;
}

void
spi_write(struct device *d, uint32_t word, uint32_t value)
{
    if (word == (is_h7() ? SPI_H7_TXDR : SPI_DR)) {
        spi_send(d, value);
        return;
    }
    if (is_h7() && word == SPI_CR2)
        d->shift = 0;
    d->regs[word] = value;
}

