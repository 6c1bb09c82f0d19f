/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * I2C masters of an STM32: bytes take no time, pins are not looked at; the
 * world's bus is the number of the peripheral.  A read asks the world for more
 * bytes than there may be.
 */
#include <string.h>

#include "unicorn_chip.h"

enum { READ_AHEAD = 64 };
/* The first version's words and bits */
enum { V1_CR1 = 0, V1_DR = 4, V1_SR1 = 5, V1_SR2 = 6 };
enum { V1_SB = 1, V1_ADDR = 2, V1_BTF = 4, V1_RXNE = 0x40, V1_AF = 0x400,
       V1_PE = 1, V1_START = 0x100, V1_STOP = 0x200 };
/* The second's */
enum { V2_CR1 = 0, V2_CR2 = 1, V2_ISR = 6, V2_ICR = 7, V2_RXDR = 9,
       V2_TXDR = 10 };
enum { V2_TXE = 1, V2_TXIS = 2, V2_RXNE = 4, V2_NACKF = 0x10, V2_STOPF = 0x20,
       V2_TC = 0x40, V2_READ = 1 << 10, V2_START = 1 << 13 };

/* What one peripheral has under way */
static struct transfer {
    uint8_t addr, wr[256], rd[256];
    uint32_t n_written, n_read, n_asked;
} transfers[4];

static bool
ask_world(struct device *d, struct transfer *t, uint32_t n_read)
{
    t->n_read = 0;
    return chip.host.i2c(chip.host.ctx, chip_now(), d->info->index, t->addr,
                         t->wr, t->n_written, t->rd, n_read) >= 0;
}

/* A device is there if it takes a write of nothing. */
static bool
is_there(struct device *d, uint8_t addr)
{
    uint8_t none = 0;

    return chip.host.i2c(chip.host.ctx, chip_now(), d->info->index, addr,
                         &none, 0, &none, 0) >= 0;
}

static void
v1_address(struct device *d, struct transfer *t, uint32_t value)
{
    bool is_read = value & 1, is_ok;

    t->addr = (uint8_t)(value >> 1);
    if (is_read)
        is_ok = ask_world(d, t, READ_AHEAD);
    else
        is_ok = is_there(d, t->addr);
    t->n_asked = is_read;
    d->regs[V1_SR1] = is_ok ? V1_ADDR : V1_AF;
}

static void
v1_write(struct device *d, struct transfer *t, uint32_t word, uint32_t value)
{
    if (word == V1_DR && d->regs[V1_SR1] & V1_SB) {
        v1_address(d, t, value);
    } else if (word == V1_DR) {
        t->wr[t->n_written++ & 255] = (uint8_t)value;
        d->regs[V1_SR1] = V1_BTF;
    } else if (word == V1_CR1) {
        if (value & V1_START)
            d->regs[V1_SR1] = V1_SB;
        if (value & V1_STOP && !t->n_asked && t->n_written)
            ask_world(d, t, 0);
        if (value & V1_STOP)
            t->n_written = 0;
        d->regs[word] = value & ~(uint32_t)(V1_START | V1_STOP);
    } else {
        d->regs[word] = value;
    }
}

static uint32_t
v1_read(struct device *d, struct transfer *t, uint32_t word)
{
    if (word == V1_SR2 && d->regs[V1_SR1] & V1_ADDR)
        d->regs[V1_SR1] = t->n_asked ? V1_RXNE | V1_BTF : 0;
    if (word == V1_DR)
        return t->rd[t->n_read++ & 255];
    return d->regs[word];
}

/* A start: the address and, of a read, all bytes. */
static void
v2_start(struct device *d, struct transfer *t, uint32_t value)
{
    bool is_ok;

    t->addr = (uint8_t)(value >> 1 & 0x7f);
    t->n_asked = value >> 16 & 255;
    if (value & V2_READ)
        is_ok = ask_world(d, t, t->n_asked);
    else
        is_ok = is_there(d, t->addr);
    d->shift = value;
    if (!(value & V2_READ))
        t->n_written = 0;
    if (!is_ok)
        d->regs[V2_ISR] = V2_NACKF | V2_STOPF;
    else if (!t->n_asked)
        d->regs[V2_ISR] = V2_STOPF;
    else
        d->regs[V2_ISR] = value & V2_READ ? V2_RXNE : V2_TXIS;
}

static void
v2_send(struct device *d, struct transfer *t, uint32_t value)
{
    t->wr[t->n_written++ & 255] = (uint8_t)value;
    if (t->n_written < t->n_asked)
        return;
    d->regs[V2_ISR] = V2_TC;
    if (d->shift & 1u << 25) {
        d->regs[V2_ISR] = V2_STOPF;
        ask_world(d, t, 0);
        t->n_written = 0;
    }
}

static uint32_t
v2_read(struct device *d, struct transfer *t, uint32_t word)
{
    uint8_t byte;

    if (word != V2_RXDR)
        return d->regs[word];
    byte = t->rd[t->n_read++ & 255];
    if (t->n_read >= t->n_asked) {
        d->regs[V2_ISR] = V2_STOPF;
        t->n_written = 0;
    }
    return byte;
}

static void
v2_write(struct device *d, struct transfer *t, uint32_t word, uint32_t value)
{
    if (word == V2_ICR) {
        d->regs[V2_ISR] &= ~value;
        return;
    }
    if (word == V2_TXDR) {
        v2_send(d, t, value);
        return;
    }
    if (word == V2_ISR)
        return;
    d->regs[word] = value;
    if (word == V2_CR2 && value & V2_START) {
        if (!(d->regs[V2_CR1] & 1))
            chip_fault("i2c %u is off", d->info->index);
        v2_start(d, t, value);
    }
}

static bool
has_v1(void)
{
    return !chip.model->usart_v2;   /* F1, F2, F4: both old */
}

uint32_t
i2c_read(struct device *d, uint32_t word)
{
    struct transfer *t = &transfers[d->info->index & 3];

    return has_v1() ? v1_read(d, t, word) : v2_read(d, t, word);
}

void
i2c_write(struct device *d, uint32_t word, uint32_t value)
{
    struct transfer *t = &transfers[d->info->index & 3];

    if (has_v1())
        v1_write(d, t, word, value);
    else
        v2_write(d, t, word, value);
}
