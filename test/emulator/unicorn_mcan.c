/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * M_CAN of Bosch, in several families (M_CAN user's manual; RM0444, 36;
 * DS60001527, 49): message memory, one fifo each way, filters of two ids, and
 * errors.  What a family does otherwise is its struct mcan_family.
 */
#include <string.h>

#include "unicorn_can.h"

enum { CCCR = 0x18 / 4, NBTP, PSR = 0x44 / 4, IR = 0x50 / 4, IE, ILS, ILE,
       GFC = 0x80 / 4, SIDFC };
enum { INIT = 1, CCE = 2, MAX_FIFO = 16 };

static const struct mcan_family *family;
static uint32_t put, get, level, tx_put, tx_get, tx_level, tec, idle_bits;
static bool is_off;

/* Where things lie, in words; how many. */
struct layout {
    uint32_t filters, n_filters, rx, n_rx, tx, n_tx, element;
};

static struct layout
find_layout(const struct device *d)
{
    uint32_t start = (d->info->index - 1u) * 0x350 / 4;
    struct layout l = { start, d->regs[GFC] >> 16 & 31, start + 0xb0 / 4, 3,
                        start + 0x278 / 4, 3, 18 };

    if (!family->is_divided) {
        l.filters = d->regs[SIDFC] >> 2 & 0x3fff;
        l.n_filters = d->regs[SIDFC] >> 16 & 255;
        l.rx = d->regs[0xa0 / 4] >> 2 & 0x3fff;
        l.n_rx = d->regs[0xa0 / 4] >> 16 & 127;
        l.tx = d->regs[0xc0 / 4] >> 2 & 0x3fff;
        l.n_tx = d->regs[0xc0 / 4] >> 24 & 63;
        l.element = 4;
        if (l.filters + l.n_filters > l.rx || l.rx + 4 * l.n_rx > l.tx
            || 4 * (l.tx + 4 * l.n_tx) > family->memory_size)
            chip_fault("parts of CAN's memory lie over each other");
    }
    return l;
}

/* Registers that lie elsewhere where memory is divided by itself. */
static uint32_t
either(uint32_t divided, uint32_t other)
{
    return family->is_divided ? divided : other;
}
static uint32_t rxf0s(void) { return either(0x90 / 4, 0xa4 / 4); }
static uint32_t rxf0a(void) { return either(0x94 / 4, 0xa8 / 4); }
static uint32_t txbar(void) { return either(0xcc / 4, 0xd0 / 4); }
static uint32_t sent_bit(void) { return either(1u << 7, 1u << 9); }
static uint32_t off_bit(void) { return either(1u << 19, 1u << 25); }
static uint32_t error_bit(void) { return either(1u << 21, 1u << 27); }

static void
update(struct device *d)
{
    core_set_level(16u + d->info->irq, d->regs[ILE] & 1
                   && d->regs[IR] & d->regs[IE] & ~d->regs[ILS]);
}

static uint32_t
read_state(struct device *d)
{
    uint32_t last = d->regs[PSR] & 7;

    d->regs[PSR] = 7;           /* none since */
    return last | (is_off ? 1u << 7 : 0) | (tec > 95 ? 1u << 6 : 0)
        | (tec > 127 ? 1u << 5 : 0);
}

uint32_t
mcan_read(struct device *d, uint32_t word)
{
    if (word == PSR)
        return read_state(d);
    if (word == rxf0s())
        return level | get << 8 | put << 16;
    if (word == 0xc4 / 4) {
        struct layout l = find_layout(d);

        return (l.n_tx - tx_level) | tx_get << 8 | tx_put << 16
            | (tx_level == l.n_tx ? 1u << 21 : 0);
    }
    return d->regs[word];
}

static const struct can_controller mcan_controller;

static void
write_cccr(struct device *d, uint32_t value)
{
    struct can_controller mine = mcan_controller;

    if (value & CCE && !(value & INIT))
        value &= ~(uint32_t)CCE;
    d->regs[CCCR] = value;
    if (value & INIT)
        return;
    family->check(d);
    mine.dev = d;
    can_attach(&mine);
    idle_bits = 0;
}

/* Does CCE protect this register? */
static bool
is_protected(uint32_t word)
{
    return word == NBTP || word == GFC || word == 0xc0 / 4
        || (!family->is_divided && (word == SIDFC || word == 0xa0 / 4));
}

void
mcan_write(struct device *d, uint32_t word, uint32_t value)
{
    if (is_protected(word) && !(d->regs[CCCR] & CCE))
        chip_fault("register %x of CAN is written while it runs", 4 * word);
    if (word == CCCR)
        write_cccr(d, value);
    else if (word == IR)
        d->regs[IR] &= ~value;
    else if (word == rxf0a()) {
        if (!level || value != get)
            chip_fault("a frame is released that was not next");
        level--;
        get = (get + 1) % find_layout(d).n_rx;
    } else if (word == txbar()) {
        if (value != 1u << tx_put)
            chip_fault("a frame is sent out of order");
        tx_put = (tx_put + 1) % find_layout(d).n_tx;
        tx_level++;
    } else
        d->regs[word] = value;
    update(d);
}

/*
 * The bus
 */

static bool
is_on(struct device *d)
{
    return family->has_clock(d) && !(d->regs[CCCR] & INIT) && !is_off;
}

static uint32_t
bit_rate(struct device *d)
{
    uint32_t n = d->regs[NBTP];

    return can_bit_rate(family->clock_hz(d), (n >> 16 & 511) + 1,
                        (n >> 8 & 255) + 1, (n & 127) + 1);
}

static bool
peek(struct device *d, struct can_frame *frame)
{
    struct layout l = find_layout(d);
    uint32_t words[4];

    if (!tx_level)
        return false;
    memcpy(words, family->memory(d, 4 * (l.tx + l.element * tx_get)),
           sizeof(words));
    frame->id = words[0] & (1u << 30) ? (words[0] & 0x1fffffff) | 1u << 31
        : words[0] >> 18 & 0x7ff;
    frame->id |= words[0] & (1u << 29) ? 1u << 30 : 0;
    frame->len = words[1] >> 16 & 15;
    memcpy(frame->data, &words[2], 8);
    return true;
}

static void
end(struct device *d, enum can_outcome outcome)
{
    if (outcome == CAN_SENT) {
        tx_level--;
        if (d->regs[txbar() + 4] & (1u << tx_get))
            d->regs[IR] |= sent_bit();
        tx_get = (tx_get + 1) % find_layout(d).n_tx;
        tec -= tec > 0;
    } else if (outcome != CAN_LOST) {
        tec = can_count_error(tec, outcome);
        d->regs[PSR] = outcome == CAN_NO_ACK ? 3 : 4;
        d->regs[IR] |= error_bit();
        if (tec > 255 && !is_off) {
            is_off = true;
            d->regs[IR] |= off_bit();
            d->regs[CCCR] |= INIT;
        }
    }
    update(d);
}

static bool
passes(struct device *d, uint32_t id)
{
    struct layout l = find_layout(d);
    uint32_t i, word;

    for (i = 0; i < l.n_filters; i++) {
        memcpy(&word, family->memory(d, 4 * (l.filters + i)), 4);
        if (word >> 30 != 1 || (word >> 27 & 7) != 1)
            continue;
        if (id == (word >> 16 & 0x7ff) || id == (word & 0x7ff))
            return true;
    }
    return (d->regs[GFC] >> 4 & 3) == 0;
}

static void
deliver(struct device *d, const struct can_frame *frame)
{
    struct layout l = find_layout(d);
    uint32_t words[4] = { (frame->id & 0x7ff) << 18, frame->len << 16 };

    if (frame->id >> 30 || !passes(d, frame->id) || level == l.n_rx)
        return;
    memcpy(&words[2], frame->data, 8);
    memcpy(family->memory(d, 4 * (l.rx + l.element * put)), words,
           sizeof(words));
    put = (put + 1) % l.n_rx;
    level++;
    d->regs[IR] |= 1;
    update(d);
}

/* Back from bus off, once the program has asked for it. */
static void
idle(struct device *d, uint32_t bits)
{
    idle_bits += bits;
    if (is_off && !(d->regs[CCCR] & INIT) && idle_bits >= 128 * 11) {
        is_off = false;
        tec = 0;
    }
    update(d);
}

static const struct can_controller mcan_controller = {
    .is_on = is_on, .bit_rate = bit_rate, .peek = peek, .end = end,
    .deliver = deliver, .idle = idle,
};

void
mcan_reset(struct device *d, const struct mcan_family *of)
{
    static const struct can_controller none;

    family = of;
    d->regs[CCCR] = INIT;
    d->regs[PSR] = 7;
    put = get = level = tx_put = tx_get = tx_level = tec = 0;
    is_off = false;
    can_attach(&none);
}
