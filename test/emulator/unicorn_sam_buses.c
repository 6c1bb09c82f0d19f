/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * SPI, USARTs as SPI masters, and two-wire masters of SAM3X, SAM4 and SAM E70
 * (11057, chapters 32, 35, 33).  In the world, USART n is SPI bus 4 + n.
 */
#include "unicorn_sam.h"

enum { CR = 0, MR = 4, TX_EMPTY = 0x200, READY = 1, TX_READY = 2 };

/* Clock outputs: pin and peripheral */
static const struct {
    uint8_t line, kind, index, pin, function;
} clocks[] = {
    { SAM3X, SAM_SPI, 0, 27, 0 }, { SAM3X, SAM_USART, 0, 17, 1 },
    { SAM3X, SAM_USART, 1, 16, 0 }, { SAM3X, SAM_USART, 2, 56, 0 },
    { SAM4S, SAM_SPI, 0, 14, 0 }, { SAM4S, SAM_USART, 0, 2, 1 },
    { SAM4S, SAM_USART, 1, 23, 0 }, { SAM4E, SAM_SPI, 0, 14, 0 },
    { SAM4E, SAM_USART, 0, 45, 2 }, { SAM4E, SAM_USART, 1, 23, 0 },
    { SAME70, SAM_SPI, 0, 118, 1 }, { SAME70, SAM_SPI, 1, 88, 2 },
    { SAME70, SAM_USART, 0, 45, 2 }, { SAME70, SAM_USART, 1, 23, 0 },
    { SAME70, SAM_USART, 2, 113, 1 },
};

static void
check_pins(const struct device *d)
{
    uint32_t i;

    for (i = 0; i < sizeof(clocks) / sizeof(clocks[0]); i++)
        if (clocks[i].line == sam_line()
            && clocks[i].kind == d->info->kind
            && clocks[i].index == d->info->index
            && sam_function_of(clocks[i].pin) == clocks[i].function)
            return;
    chip_fault("spi or usart %u has no clock pin", d->info->index);
}

static void
exchange(struct device *d, uint32_t bus, uint32_t value, uint32_t divider)
{
    uint8_t byte = (uint8_t)value;

    if (d->due != NEVER || d->has_tdr)
        chip_fault("the model has room for one byte");
    check_pins(d);
    if (chip.is_broken)
        return;
    chip.host.spi(chip.host.ctx, chip_now(), bus, &byte, 1);
    d->rx_data = byte;
    bus_plan(d, 8ull * divider * sam_divider());
}

static void
byte_event(struct device *d)
{
    d->has_tdr = true;          /* here: something was received */
}

static uint32_t
byte_status(const struct device *d)
{
    bool is_idle = d->due == NEVER;

    return (d->has_tdr ? READY : 0) | (is_idle ? TX_READY | TX_EMPTY : 0);
}

/*
 * SPI
 */

enum { RDR = 8, TDR = 0xc, SPI_SR = 0x10, CSR0 = 0x30 };

static void
spi_unit_write(struct device *d, uint32_t offset, uint32_t value)
{
    if (offset == CR) {
        d->shift = value & 1 ? 1 : value & 0x82 ? 0 : d->shift;
        if (value & 0x80)
            d->regs[MR / 4] = d->regs[CSR0 / 4] = 0;
        return;
    }
    if (offset != TDR) {
        d->regs[offset / 4] = value;
        return;
    }
    if (!d->shift || (d->regs[MR / 4] & 0xf0013) != 0xe0011
        || !(d->regs[CSR0 / 4] >> 8 & 255) || d->regs[CSR0 / 4] & 0xf0)
        chip_fault("spi %u is no master of 8 bits", d->info->index);
    exchange(d, d->info->index, value, d->regs[CSR0 / 4] >> 8 & 255);
}

static uint32_t
spi_unit_read(struct device *d, uint32_t offset)
{
    if (offset == SPI_SR)
        return byte_status(d);
    if (offset == RDR) {
        d->has_tdr = false;
        return d->rx_data;
    }
    return d->regs[offset / 4];
}

const struct device_ops sam_spi_ops = {
    NULL, spi_unit_read, spi_unit_write, byte_event,
};

/*
 * USART
 */

enum { US_CSR = 0x14, US_RHR = 0x18, US_THR = 0x1c, US_BRGR = 0x20 };

static void
usart_unit_write(struct device *d, uint32_t offset, uint32_t value)
{
    if (offset == CR) {
        d->shift = (value & 0x50) == 0x50 ? 1 : value & 0xc ? 0 : d->shift;
        return;
    }
    if (offset != US_THR) {
        d->regs[offset / 4] = value;
        return;
    }
    if (!d->shift || (d->regs[MR / 4] & 0x400ff) != 0x400ce
        || d->regs[US_BRGR / 4] < 6)
        chip_fault("usart %u is no spi master", d->info->index);
    exchange(d, 4u + d->info->index, value, d->regs[US_BRGR / 4]);
}

static uint32_t
usart_unit_read(struct device *d, uint32_t offset)
{
    if (offset == US_CSR)
        return byte_status(d);
    if (offset == US_RHR) {
        d->has_tdr = false;
        return d->rx_data;
    }
    return d->regs[offset / 4];
}

const struct device_ops sam_usart_ops = {
    NULL, usart_unit_read, usart_unit_write, byte_event,
};

/*
 * Two-wire.  The world sees whole transfers; a read asks it for more bytes than
 * there may be.
 */

enum { MMR = 4, IADR = 0xc, CWGR = 0x10, TWI_SR = 0x20, TWI_RHR = 0x30,
       TWI_THR = 0x34 };
enum { START = 1, STOP = 2, MSEN = 4, QUICK = 0x40, SWRST = 0x80 };
enum { TXCOMP = 1, RXRDY = 2, TXRDY = 4, OVRE = 0x40, NACK = 0x100,
       MREAD = 1 << 12, READ_AHEAD = 64 };

static struct transfer {
    uint8_t wr[256], rd[READ_AHEAD];
    uint32_t n_written, n_read;
    bool is_on, is_refused, is_reading, stops, is_open;
} transfers[3];

static bool
ask_world(struct device *d, struct transfer *t, uint32_t n_wr, uint32_t n_rd)
{
    return chip.host.i2c(chip.host.ctx, chip_now(), d->info->index,
                         d->regs[MMR / 4] >> 16 & 127, t->wr, n_wr, t->rd,
                         n_rd) >= 0;
}

static void
plan_bits(struct device *d, uint32_t bits)
{
    uint32_t cwgr = d->regs[CWGR / 4], shift = cwgr >> 16 & 7;
    uint32_t more = sam_line() == SAME70 ? 3 : 4;
    uint32_t bit = ((cwgr & 255) << shift) + ((cwgr >> 8 & 255) << shift)
        + 2 * more;

    if (chip.bus_hz[1] / bit > 405000)
        chip_fault("two-wire bus at %u Hz", chip.bus_hz[1] / bit);
    bus_plan(d, (uint64_t)bits * bit * sam_divider());
}

static void
begin_read(struct device *d, struct transfer *t)
{
    uint32_t size = d->regs[MMR / 4] >> 8 & 3, i;

    for (i = 0; i < size; i++)
        t->wr[i] = (uint8_t)(d->regs[IADR / 4] >> 8 * (size - 1 - i));
    t->is_reading = t->is_open = true;
    t->n_read = 0;
    t->is_refused = !ask_world(d, t, size, READ_AHEAD);
    d->regs[TWI_SR / 4] &= ~(uint32_t)(TXCOMP | RXRDY);
    plan_bits(d, 9 * (2 + size) + (size ? 9 : 0));
}

static void
end_write(struct device *d, struct transfer *t)
{
    ask_world(d, t, t->n_written, 0);
    t->n_written = 0;
    t->is_open = t->stops = false;
    d->regs[TWI_SR / 4] |= TXCOMP | TXRDY;
}

static void
write_control(struct device *d, struct transfer *t, uint32_t value)
{
    if (value & SWRST)
        *t = (struct transfer) { .is_on = false };
    if (value & MSEN)
        t->is_on = true;
    if (value & STOP)
        t->stops = true;
    if (value & (START | STOP | QUICK) && !t->is_on)
        chip_fault("two-wire bus %u is off", d->info->index);
    if (value & START)
        begin_read(d, t);
    if (value & QUICK) {
        t->is_refused = !ask_world(d, t, 0, 0);
        t->is_reading = false;
        t->is_open = t->stops = true;
        d->regs[TWI_SR / 4] &= ~(uint32_t)TXCOMP;
        plan_bits(d, 10);
    }
    if (t->stops && t->is_open && !t->is_reading && d->due == NEVER)
        end_write(d, t);
}

/* A byte to send; the first one goes with the address. */
static void
write_byte(struct device *d, struct transfer *t, uint32_t value)
{
    bool is_first = !t->is_open;

    if (!(d->regs[TWI_SR / 4] & TXRDY) || d->regs[MMR / 4] & MREAD)
        chip_fault("two-wire bus %u: no byte wanted", d->info->index);
    if (is_first)
        t->is_refused = !ask_world(d, t, 0, 0);
    t->is_open = true;
    t->is_reading = false;
    t->wr[t->n_written++ & 255] = (uint8_t)value;
    d->regs[TWI_SR / 4] &= ~(uint32_t)(TXRDY | TXCOMP);
    plan_bits(d, is_first ? 18 : 9);
}

static void
refuse(struct device *d, struct transfer *t)
{
    bool is_on = t->is_on;

    *t = (struct transfer) { .is_on = is_on };
    d->regs[TWI_SR / 4] |= NACK | TXCOMP | TXRDY;
}

static void
two_wire_event(struct device *d)
{
    struct transfer *t = &transfers[d->info->index];
    uint32_t *status = &d->regs[TWI_SR / 4];

    if (t->is_refused) {
        refuse(d, t);
        return;
    }
    if (!t->is_reading) {
        *status |= TXRDY;
        if (t->stops)
            end_write(d, t);
        return;
    }
    if (*status & RXRDY)
        *status |= OVRE;
    d->regs[TWI_RHR / 4] = t->rd[t->n_read++ % READ_AHEAD];
    *status |= RXRDY;
    if (t->stops) {
        t->is_open = t->stops = t->is_reading = false;
        *status |= TXCOMP;
    } else {
        plan_bits(d, 9);
    }
}

static void
two_wire_write(struct device *d, uint32_t offset, uint32_t value)
{
    struct transfer *t = &transfers[d->info->index];

    if (offset == CR)
        write_control(d, t, value);
    else if (offset == TWI_THR)
        write_byte(d, t, value);
    else
        d->regs[offset / 4] = value;
}

static uint32_t
two_wire_read(struct device *d, uint32_t offset)
{
    uint32_t value = d->regs[offset / 4];

    if (offset == TWI_RHR)
        d->regs[TWI_SR / 4] &= ~(uint32_t)RXRDY;
    if (offset == TWI_SR)
        d->regs[TWI_SR / 4] &= ~(uint32_t)(NACK | OVRE);
    return value;
}

static void
two_wire_reset(struct device *d)
{
    transfers[d->info->index] = (struct transfer) { .is_on = false };
    d->regs[TWI_SR / 4] = TXCOMP | TXRDY;
}

const struct device_ops sam_twi_ops = {
    two_wire_reset, two_wire_read, two_wire_write, two_wire_event,
};
