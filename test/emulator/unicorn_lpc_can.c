/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * CAN of an LPC176x (UM10360, 16): three buffers that send, two that receive,
 * the filter that both controllers share, and errors.
 */
#include <string.h>

#include "unicorn_can.h"
#include "unicorn_lpc.h"

enum { MOD, CMR, GSR, ICR, IER, BTR, EWL, SR, RFS, RID, RDA, RDB, TX0 };
enum { RESET_MODE = 1, TPM = 8, RELEASE = 4, AFMR = 0, AF_OFF = 1, AF_ALL = 2,
       FIFO_SIZE = 2 };
enum { INT_RX = 1, INT_WARNING = 4, INT_PASSIVE = 0x20, INT_ERROR = 0x80 };

static struct can_frame fifo[FIFO_SIZE];
static uint32_t n_fifo, tec, idle_bits, n_lost;
static bool wants[3], is_off;

static const uint32_t sent_bits[3] = { 1u << 1, 1u << 9, 1u << 10 };

static void
update(struct device *d)
{
    if (n_fifo)
        d->regs[ICR] |= INT_RX;
    core_set_level(16u + d->info->irq, (d->regs[ICR] & d->regs[IER]) != 0);
}

static void
show_fifo(struct device *d)
{
    const struct can_frame *f = &fifo[0];

    d->regs[RFS] = f->len << 16 | (f->id & 1u << 31) | (f->id & 1u << 30);
    d->regs[RID] = f->id & 0x1fffffff;
    memcpy(&d->regs[RDA], f->data, 8);
}

static uint32_t
status(void)
{
    return (n_fifo ? 1u : 0) | (wants[0] || wants[1] || wants[2] ? 0 : 0xcu)
        | (tec > 95 ? 0x40u : 0) | (is_off ? 0x80u : 0);
}

/* Buffer by buffer: free, and its last frame is out */
static uint32_t
buffers(void)
{
    uint32_t bits = 0, i;

    for (i = 0; i < 3; i++)
        bits |= (wants[i] ? 0u : 0xcu) << 8 * i;
    return bits;
}

static uint32_t
can_read(struct device *d, uint32_t offset)
{
    uint32_t value = d->regs[offset / 4];

    switch (offset / 4) {
    case GSR:
        return status() | tec << 24;
    case SR:
        return buffers() | (n_fifo ? 0x010101u : 0);
    case ICR:
        d->regs[ICR] = 0;       /* but for what was received */
        update(d);
        return value;
    default:
        return value;
    }
}

static void
check(const struct device *d)
{
    static const struct { uint8_t index, rx, tx, function; } pins[] = {
        { 1, 0, 1, 1 }, { 1, 21, 22, 3 }, { 2, 4, 5, 2 }, { 2, 71, 72, 1 } };
    uint32_t sel = bus_find(LPC_SYSCON, 0)->regs[0x1a8 / 4] >> 26, i;

    if ((sel & 3) != (sel >> 2 & 3) || (sel & 3) != (sel >> 4 & 3))
        chip_fault("clocks of CAN1, CAN2 and the filter differ");
    for (i = 0; i < 4; i++)
        if (pins[i].index == d->info->index
            && lpc_function_of(pins[i].rx) == pins[i].function
            && lpc_function_of(pins[i].tx) == pins[i].function)
            return;
    chip_fault("CAN%u has no pins", d->info->index);
}

static const struct can_controller lpc_controller;

static void
enter_reset(struct device *d)
{
    d->regs[MOD] |= RESET_MODE;
    memset(wants, 0, sizeof(wants));
}

static void
write_mod(struct device *d, uint32_t value)
{
    struct can_controller mine = lpc_controller;

    if (!(d->regs[MOD] & RESET_MODE) && (d->regs[MOD] ^ value) & ~1u)
        chip_fault("CAN's mode is changed while it runs");
    d->regs[MOD] = value;
    if (value & RESET_MODE) {
        enter_reset(d);
        return;
    }
    check(d);
    mine.dev = d;
    can_attach(&mine);
    idle_bits = 0;
}

static void
write_cmr(struct device *d, uint32_t value)
{
    uint32_t i;

    for (i = 0; i < 3; i++)
        if (value & 0x20u << i && value & 1)
            wants[i] = true;
    if (value & RELEASE && n_fifo) {
        memmove(fifo, &fifo[1], --n_fifo * sizeof(fifo[0]));
        show_fifo(d);
        if (!n_fifo)
            d->regs[ICR] &= ~(uint32_t)INT_RX;
    }
}

static void
can_write(struct device *d, uint32_t offset, uint32_t value)
{
    uint32_t word = offset / 4;

    if ((word == BTR || word == GSR || word == EWL)
        && !(d->regs[MOD] & RESET_MODE))
        chip_fault("register %x of CAN is written while it runs", offset);
    if (word >= TX0 && wants[(word - TX0) / 4])
        chip_fault("buffer %u is written while it waits", (word - TX0) / 4);
    if (word == MOD)
        write_mod(d, value);
    else if (word == CMR)
        write_cmr(d, value);
    else
        d->regs[word] = value;
    update(d);
}

static void
can_reset(struct device *d)
{
    static const struct can_controller none;

    d->regs[MOD] = RESET_MODE;
    d->regs[BTR] = 0x1c0000;
    d->regs[EWL] = 0x60;
    memset(wants, 0, sizeof(wants));
    n_fifo = tec = n_lost = 0;
    is_off = false;
    can_attach(&none);
}

const struct device_ops lpc_can_ops = {
    can_reset, can_read, can_write, NULL,
};

/*
 * The filter
 */

static void
canaf_reset(struct device *d)
{
    d->regs[AFMR] = AF_OFF;
}

static void
canaf_write(struct device *d, uint32_t offset, uint32_t value)
{
    if (offset && !(d->regs[AFMR] & (AF_OFF | AF_ALL)))
        chip_fault("a table of CAN's filter changes while it is in use");
    d->regs[offset / 4] = value;
}

static void
table_write(struct device *d, uint32_t offset, uint32_t value)
{
    if (!(bus_find(LPC_CANAF, 0)->regs[AFMR] & AF_OFF))
        chip_fault("CAN's filter is written while it is in use");
    d->regs[offset / 4] = value;
}

const struct device_ops lpc_canaf_ops = {
    canaf_reset, NULL, canaf_write, NULL,
};
const struct device_ops lpc_can_table_ops = { NULL, NULL, table_write, NULL };

/* Entries of 16 bits, the upper one first; they must grow. */
static bool
passes(const struct device *d, uint32_t id)
{
    const uint32_t *af = bus_find(LPC_CANAF, 0)->regs;
    const uint32_t *table = bus_find(LPC_CAN_TABLE, 0)->regs;
    uint32_t i, entry, last = 0, wanted = (d->info->index - 1u) << 13 | id;
    bool found = false;

    if (af[AFMR] & AF_ALL)
        return true;
    if (af[AFMR] & AF_OFF)
        return false;
    for (i = af[1] / 2; i < af[2] / 2; i++) {
        entry = table[i / 2] >> (i & 1 ? 0 : 16) & 0xffff;
        if ((entry & 0xe7ff) < last)
            chip_fault("entries of CAN's filter do not grow");
        last = entry & 0xe7ff;
        found = found || entry == wanted;
    }
    return found;
}

/*
 * The bus
 */

static bool
is_on(struct device *d)
{
    return lpc_has_clock(d) && !(d->regs[MOD] & RESET_MODE) && !is_off;
}

static uint32_t
bit_rate(struct device *d)
{
    uint32_t btr = d->regs[BTR];

    return can_bit_rate(chip.core_hz / lpc_divider(d), (btr & 1023) + 1,
                        (btr >> 16 & 15) + 1, (btr >> 20 & 7) + 1);
}

/* Of those that wait, the one with the least number that it was given. */
static int
find_buffer(const struct device *d)
{
    int found = -1, i;

    for (i = 0; i < 3; i++)
        if (wants[i] && (found < 0 || (d->regs[TX0 + 4 * i] & 255)
                         < (d->regs[TX0 + 4 * found] & 255)))
            found = i;
    if (found >= 0 && !(d->regs[MOD] & TPM))
        chip_fault("frames are sent in the order of their ids");
    return found;
}

static bool
peek(struct device *d, struct can_frame *frame)
{
    int i = find_buffer(d);
    const uint32_t *regs;

    if (i < 0)
        return false;
    regs = &d->regs[TX0 + 4 * i];
    frame->id = regs[1] | (regs[0] & 3u << 30);
    frame->len = regs[0] >> 16 & 15;
    memcpy(frame->data, &regs[2], 8);
    return true;
}

static void
end(struct device *d, enum can_outcome outcome)
{
    int i = find_buffer(d);

    if (outcome == CAN_SENT) {
        wants[i] = false;
        d->regs[ICR] |= sent_bits[i];
        tec -= tec > 0;
    } else if (outcome != CAN_LOST) {
        tec = can_count_error(tec, outcome);
        /* of another kind, where an acknowledge was expected; or a bit of data */
        d->regs[ICR] |= INT_ERROR | (outcome == CAN_NO_ACK
                                     ? 3u << 22 | 0x19u << 16 : 0x0au << 16);
        if (tec == 96)
            d->regs[ICR] |= INT_WARNING;
        if (tec > 255) {
            is_off = true;
            tec = 127;
            d->regs[ICR] |= INT_WARNING;
            enter_reset(d);
        }
    }
    update(d);
}

static void
deliver(struct device *d, const struct can_frame *frame)
{
    if (frame->id >> 30 || !passes(d, frame->id))
        return;
    if (n_fifo == FIFO_SIZE) {
        n_lost++;
        return;
    }
    fifo[n_fifo++] = *frame;
    show_fifo(d);
    update(d);
}

/* Back from bus off, once the program has left the reset. */
static void
idle(struct device *d, uint32_t bits)
{
    idle_bits += bits;
    if (!is_off || d->regs[MOD] & RESET_MODE || idle_bits < 128 * 11)
        return;
    is_off = false;
    tec = 0;
    d->regs[ICR] |= INT_WARNING;
    update(d);
}

static const struct can_controller lpc_controller = {
    .is_on = is_on, .bit_rate = bit_rate, .peek = peek, .end = end,
    .deliver = deliver, .idle = idle,
};
