/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * SSP and I2C masters of an LPC176x (UM10360, chapters 17 and 19).  One byte at
 * a time; of I2C the world sees whole transfers.
 */
#include "unicorn_lpc.h"

/*
 * SSP
 */

enum { CR0 = 0, CR1 = 1, DR = 2, SR = 3, CPSR = 4 };
enum { SR_TFE = 1, SR_TNF = 2, SR_RNE = 4, SR_BSY = 0x10 };

static void
ssp_write(struct device *d, uint32_t offset, uint32_t value)
{
    static const uint8_t clocks[] = { 15, 7 };
    uint8_t byte = (uint8_t)value;
    uint32_t divider = d->regs[CPSR] * ((d->regs[CR0] >> 8 & 255) + 1);

    if (offset / 4 != DR) {
        if (d->due != NEVER && offset / 4 <= CPSR)
            chip_fault("ssp %u changed while it works", d->info->index);
        d->regs[offset / 4] = value;
        return;
    }
    if ((d->regs[CR1] & 0xf) != 2 || (d->regs[CR0] & 0x3f) != 7
        || d->regs[CPSR] < 2 || d->regs[CPSR] & 1)
        chip_fault("ssp %u is no master of 8 bits", d->info->index);
    if (d->due != NEVER || d->has_tdr)
        chip_fault("ssp %u: the model has a fifo of one", d->info->index);
    if (lpc_function_of(clocks[d->info->index]) != 2)
        chip_fault("ssp %u has no pins", d->info->index);
    if (chip.is_broken)
        return;
    chip.host.spi(chip.host.ctx, chip_now(), d->info->index, &byte, 1);
    d->rx_data = byte;
    bus_plan(d, 8ull * divider * lpc_divider(d));
}

static void
ssp_event(struct device *d)
{
    d->has_tdr = true;          /* here: something was received */
}

static uint32_t
ssp_read(struct device *d, uint32_t offset)
{
    if (offset / 4 == SR)
        return SR_TFE | SR_TNF | (d->has_tdr ? SR_RNE : 0)
            | (d->due == NEVER ? 0 : SR_BSY);
    if (offset / 4 != DR)
        return d->regs[offset / 4];
    if (!d->has_tdr)
        chip_fault("ssp %u read while its fifo is empty", d->info->index);
    d->has_tdr = false;
    return d->rx_data;
}

const struct device_ops lpc_ssp_ops = { NULL, ssp_read, ssp_write, ssp_event };

/*
 * I2C
 */

enum { CONSET = 0, STAT = 1, DAT = 2, SCLH = 4, SCLL = 5, CONCLR = 6 };
enum { AA = 4, SI = 8, STO = 0x10, STA = 0x20, EN = 0x40, READ_AHEAD = 64 };

/* What a bus is doing; `next` is the status that its next step ends with. */
static struct transfer {
    uint8_t addr, wr[256], rd[READ_AHEAD], next;
    uint32_t n_written, n_read;
    bool is_reading, is_open;
} transfers[3];

static int32_t
ask_world(struct device *d, struct transfer *t, uint32_t n_written,
          uint32_t n_read)
{
    return chip.host.i2c(chip.host.ctx, chip_now(), d->info->index, t->addr,
                         t->wr, n_written, t->rd, n_read);
}

static uint8_t
send_address(struct device *d, struct transfer *t)
{
    uint32_t byte = d->regs[DAT];

    t->addr = (uint8_t)(byte >> 1 & 127);
    t->is_reading = byte & 1;
    t->n_read = 0;
    if (!t->is_reading) {
        t->n_written = 0;
        return ask_world(d, t, 0, 0) < 0 ? 0x20 : 0x18;
    }
    return ask_world(d, t, t->n_written, READ_AHEAD) < 0 ? 0x48 : 0x40;
}

/* The step that begins as SI is cleared: its outcome. */
static uint8_t
take_step(struct device *d, struct transfer *t)
{
    uint32_t was = d->regs[STAT];

    if (d->regs[CONSET] & STA)
        return t->is_open ? 0x10 : 0x08;
    if (was == 0x08 || was == 0x10)
        return send_address(d, t);
    if (was == 0x18 || was == 0x28) {
        t->wr[t->n_written++ & 255] = (uint8_t)d->regs[DAT];
        return 0x28;
    }
    if (was != 0x40 && was != 0x50) {
        chip_fault("i2c %u goes on after status 0x%x", d->info->index, was);
        return 0xf8;
    }
    d->regs[DAT] = t->rd[t->n_read++ % READ_AHEAD];
    return d->regs[CONSET] & AA ? 0x50 : 0x58;
}

static void
stop(struct device *d, struct transfer *t)
{
    if (d->regs[STAT] == 0x50)
        chip_fault("i2c %u stops a read that it has acknowledged",
                   d->info->index);
    if (t->is_open && !t->is_reading && t->n_written)
        ask_world(d, t, t->n_written, 0);
    t->n_written = 0;
    t->is_open = false;
    d->regs[STAT] = 0xf8;
    d->regs[CONSET] &= ~(uint32_t)(STO | SI);
}

static void
check_speed(struct device *d)
{
    uint32_t cycles = (d->regs[SCLL] + d->regs[SCLH]) * lpc_divider(d);

    if (d->regs[SCLL] < 4 || d->regs[SCLH] < 4
        || chip.core_hz / cycles > 400000)
        chip_fault("i2c %u at more than 400 kHz", d->info->index);
}

static void
begin_step(struct device *d, struct transfer *t)
{
    check_speed(d);
    t->next = take_step(d, t);
    bus_plan(d, 9ull * (d->regs[SCLL] + d->regs[SCLH]) * lpc_divider(d));
}

static void
master_write(struct device *d, uint32_t offset, uint32_t value)
{
    struct transfer *t = &transfers[d->info->index];
    uint32_t *control = &d->regs[CONSET];

    if (offset / 4 == CONSET) {
        *control |= value;
        if (value & STA && *control & EN && !t->is_open && d->due == NEVER)
            begin_step(d, t);
    } else if (offset / 4 == CONCLR) {
        *control &= ~value;
        if (value & EN && !(*control & EN))
            t->is_open = false;
        if (value & SI && *control & STO)
            stop(d, t);
        else if (value & SI && t->is_open && d->due == NEVER)
            begin_step(d, t);
    } else {
        d->regs[offset / 4] = value;
    }
}

static void
master_event(struct device *d)
{
    struct transfer *t = &transfers[d->info->index];

    t->is_open = true;
    d->regs[STAT] = t->next;
    d->regs[CONSET] |= SI;
}

static void
master_reset(struct device *d)
{
    transfers[d->info->index] = (struct transfer) { .addr = 0 };
    d->regs[STAT] = 0xf8;
}

const struct device_ops lpc_i2c_ops = {
    master_reset, NULL, master_write, master_event,
};
