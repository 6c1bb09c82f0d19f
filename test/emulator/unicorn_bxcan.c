/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bxCAN (RM0008, 24): mailboxes, filters, the fifo, and errors.
 */
#include <string.h>

#include "unicorn_can.h"

enum { MCR, MSR, TSR, RF0R, RF1R, IER, ESR, BTR, TX0 = 0x180 / 4,
       RX0 = 0x1b0 / 4, FMR = 0x200 / 4, FM1R, FS1R = 0x20c / 4,
       FFA1R = 0x214 / 4, FA1R = 0x21c / 4, BANKS = 0x240 / 4 };
enum { INRQ = 1, INAK = 1, ERRI = 4, TXRQ = 1, FIFO_SIZE = 3 };

static struct can_frame fifo[FIFO_SIZE];
static uint32_t n_fifo, n_requests, requested[3], tec, idle_bits;
static bool is_off;

static void
set_irq(struct device *d, uint32_t which, bool on)
{
    bool is_f0 = chip.model->line == LINE_F0;

    core_set_level(16u + d->info->irq + (is_f0 ? 0 : which), on);
}

static void
update(struct device *d)
{
    uint32_t ier = d->regs[IER], esr = d->regs[ESR] & 0x70;
    bool tx, rx, error;

    if (is_off)
        esr |= 4;
    if (tec > 127)
        esr |= 2;
    if (tec > 95)
        esr |= 1;
    d->regs[ESR] = esr | (tec & 255) << 16;
    d->regs[RF0R] = n_fifo;
    tx = ier & 1 && d->regs[TSR] & 0x10101;
    rx = ier & 2 && n_fifo;
    error = (ier & (1u << 15)) && d->regs[MSR] & ERRI;
    if (chip.model->line == LINE_F0) {
        set_irq(d, 0, tx || rx || error);
        return;
    }
    set_irq(d, 0, tx);
    set_irq(d, 1, rx);
    set_irq(d, 3, error);
}

static void
show_fifo(struct device *d)
{
    const struct can_frame *f = &fifo[0];

    d->regs[RX0] = f->id & (1u << 31)
        ? (f->id & 0x1fffffff) << 3 | 4 : (f->id & 0x7ff) << 21;
    if (f->id & (1u << 30))
        d->regs[RX0] |= 2;
    d->regs[RX0 + 1] = f->len;
    memcpy(&d->regs[RX0 + 2], f->data, 8);
}

/*
 * Registers
 */

static void
note_error(struct device *d, uint32_t code)
{
    d->regs[ESR] = (d->regs[ESR] & ~0x70u) | code << 4;
    if (d->regs[IER] & (1u << 11))
        d->regs[MSR] |= ERRI;
}

static bool is_on(struct device *d);

static void
attach(struct device *d)
{
    extern const struct can_controller bxcan_controller;
    struct can_controller mine = bxcan_controller;

    mine.dev = d;
    can_attach(&mine);
}

static void
write_mcr(struct device *d, uint32_t value)
{
    d->regs[MCR] = value;
    d->regs[MSR] = (d->regs[MSR] & ~(uint32_t)INAK) | (value & INRQ);
    if (!(value & INRQ))
        attach(d);
}

/* Mailboxes that were asked to send keep their order if TXFP says so. */
static void
write_tx(struct device *d, uint32_t word, uint32_t value)
{
    uint32_t box = (word - TX0) / 4;

    if (!(d->regs[TSR] & (1u << (26 + box)))) {
        chip_fault("mailbox %u is written while it is full", box);
        return;
    }
    d->regs[word] = value;
    if ((word - TX0) % 4 || !(value & TXRQ))
        return;
    d->regs[TSR] &= ~(1u << (26 + box));
    requested[box] = n_requests++;
}

uint32_t
bxcan_read(struct device *d, uint32_t word)
{
    return d->regs[word];
}

void
bxcan_write(struct device *d, uint32_t word, uint32_t value)
{
    if (word == MCR)
        write_mcr(d, value);
    else if (word == MSR)
        d->regs[MSR] &= ~(value & ERRI);
    else if (word == TSR)
        d->regs[TSR] &= ~(value & 0x010101u);
    else if (word == RF0R && value & (1u << 5) && n_fifo) {
        memmove(fifo, &fifo[1], --n_fifo * sizeof(fifo[0]));
        show_fifo(d);
    } else if (word == BTR && !(d->regs[MSR] & INAK))
        chip_fault("CAN's bit time is written while it runs");
    else if (word >= TX0 && word < RX0)
        write_tx(d, word, value);
    else if (word == ESR)
        d->regs[ESR] = (d->regs[ESR] & ~0x70u) | (value & 0x70);
    else if (word >= BANKS && !(d->regs[FMR] & 1))
        chip_fault("a filter is written while it is in use");
    else if (word != RF0R)
        d->regs[word] = value;
    update(d);
}

/*
 * The bus
 */

static bool
is_on(struct device *d)
{
    return rcc_has_clock(d) && !(d->regs[MSR] & INAK) && !is_off;
}

static uint32_t
bit_rate(struct device *d)
{
    uint32_t btr = d->regs[BTR];

    return can_bit_rate(chip.bus_hz[1], (btr & 1023) + 1, (btr >> 16 & 15) + 1,
                        (btr >> 20 & 7) + 1);
}

/* Number of the mailbox that is next, -1 without. */
static int
find_box(struct device *d)
{
    int found = -1, i;

    for (i = 0; i < 3; i++)
        if (d->regs[TX0 + 4 * i] & TXRQ
            && (found < 0 || requested[i] < requested[found]))
            found = i;
    if (found >= 0 && !(d->regs[MCR] & 4))
        chip_fault("frames are sent in the order of their ids");
    return found;
}

static bool
peek(struct device *d, struct can_frame *frame)
{
    int box = find_box(d);
    const uint32_t *regs;

    if (box < 0)
        return false;
    regs = &d->regs[TX0 + 4 * box];
    frame->id = regs[0] & 4 ? regs[0] >> 3 | 1u << 31 : regs[0] >> 21;
    frame->id |= regs[0] & 2 ? 1u << 30 : 0;
    frame->len = regs[1] & 15;
    memcpy(frame->data, &regs[2], 8);
    return true;
}

static void
end(struct device *d, enum can_outcome outcome)
{
    uint32_t box = (uint32_t)find_box(d);

    if (outcome == CAN_SENT) {
        d->regs[TX0 + 4 * box] &= ~(uint32_t)TXRQ;
        d->regs[TSR] |= 1u << (26 + box) | 3u << (8 * box);
        tec -= tec > 0;
    } else if (outcome != CAN_LOST) {
        tec = can_count_error(tec, outcome);
        note_error(d, outcome == CAN_NO_ACK ? 3 : 4);
        is_off = tec > 255;
        idle_bits = 0;
    }
    update(d);
}

/* Does a bank let this id pass? */
static bool
bank_passes(struct device *first, uint32_t bank, uint32_t id)
{
    const uint32_t *f = &first->regs[BANKS + 2 * bank];
    uint32_t bit = 1u << bank;
    uint16_t ids[4], coded = (uint16_t)(id << 5);

    if (!(first->regs[FA1R] & bit) || first->regs[FFA1R] & bit)
        return false;
    if (first->regs[FS1R] & bit)
        return ((id << 21) & f[1]) == (f[0] & f[1]);
    memcpy(ids, f, sizeof(ids));
    if (!(first->regs[FM1R] & bit))
        return ((coded ^ ids[0]) & ids[1]) == 0;
    return coded == ids[0] || coded == ids[1] || coded == ids[2]
        || coded == ids[3];
}

static void
deliver(struct device *d, const struct can_frame *frame)
{
    struct device *first = stm32_find(DEV_CAN, 1);
    uint32_t bank = d->info->index == 2 ? 14 : 0;
    uint32_t end_bank = d->info->index == 2 ? 28 : 14;

    if (first->regs[FMR] & 1)
        return;
    for (; bank < end_bank; bank++)
        if (bank_passes(first, bank, frame->id & 0x7ff))
            break;
    if (bank == end_bank || frame->id >> 30)
        return;
    if (n_fifo == FIFO_SIZE)
        n_fifo--;               /* the last one is overwritten */
    fifo[n_fifo++] = *frame;
    show_fifo(d);
    update(d);
}

/* Back from bus off, by itself, after 128 times eleven idle bits. */
static void
idle(struct device *d, uint32_t bits)
{
    idle_bits += bits;
    if (is_off && d->regs[MCR] & (1u << 6) && idle_bits >= 128 * 11) {
        is_off = false;
        tec = 0;
    }
    update(d);
}

const struct can_controller bxcan_controller = {
    .is_on = is_on, .bit_rate = bit_rate, .peek = peek, .end = end,
    .deliver = deliver, .idle = idle,
};

void
bxcan_reset(struct device *d)
{
    static const struct can_controller none;

    d->regs[MCR] = 1u << 16 | 2;
    d->regs[MSR] = 0xc02;
    d->regs[TSR] = 7u << 26;
    d->regs[FMR] = 0x2a1c0e01;
    n_fifo = n_requests = tec = 0;
    is_off = false;
    can_attach(&none);
}
