/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The full-speed USB device of an STM32 (RM0008, 23; RM0091, 30; RM0444, 37):
 * endpoints, their packet memory, and what they answer.
 */
#include <string.h>

#include "unicorn_stm32.h"
#include "unicorn_usbhost.h"

enum { CNTR = 16, ISTR = 17, DADDR = 19, BTABLE = 20, BCDR = 22 };
enum { CTR_RX = 1 << 15, DTOG_RX = 1 << 14, SETUP = 1 << 11, CTR_TX = 1 << 7,
       DTOG_TX = 1 << 6, EA = 15 };
enum { DISABLED, STALL, NAK, VALID };
enum { FRES = 1, PDWN = 2, RESET = 1 << 10 };
#define STAT_RX(EPR) (((EPR) >> 12) & 3)
#define STAT_TX(EPR) (((EPR) >> 4) & 3)

static uint8_t memory[2048];
static struct device *dev;

static bool
is_g0(void)
{
    return chip.model->line == LINE_G0;
}

static uint32_t
memory_size(void)
{
    return is_g0() ? 2048 : chip.model->line == LINE_F1 ? 512 : 1024;
}

/*
 * Packet memory as the processor sees it
 */

/* Where a halfword, of a G0 a word, lies; faults for other accesses. */
static uint8_t *
find_unit(uint32_t offset, unsigned size)
{
    uint32_t at = offset;

    if (chip.model->line == LINE_F1)
        at = offset / 2;
    if (size != (is_g0() ? 4 : 2) || offset % (chip.model->line == LINE_F1
                                               ? 4 : size)
        || at >= memory_size()) {
        chip_fault("%u bytes at 0x%x of the USB memory", size, offset);
        at = 0;
    }
    return &memory[at];
}

uint32_t
usbfs_memory_read(uint32_t offset, unsigned size)
{
    uint32_t value = 0;

    memcpy(&value, find_unit(offset, size), is_g0() ? 4 : 2);
    return value;
}

void
usbfs_memory_write(uint32_t offset, unsigned size, uint32_t value)
{
    memcpy(find_unit(offset, size), &value, is_g0() ? 4 : 2);
}

/* Address and count field of a buffer: half 0 sends, 1 receives. */
static uint32_t
read_entry(uint32_t ep, uint32_t half, uint32_t *count)
{
    uint16_t words[2];

    memcpy(words, &memory[(is_g0() ? 0 : dev->regs[BTABLE]) + 8 * ep
                          + 4 * half], 4);
    *count = words[1];
    return words[0];
}

static void
write_count(uint32_t ep, uint32_t len)
{
    uint8_t *at = &memory[(is_g0() ? 0 : dev->regs[BTABLE]) + 8 * ep + 6];
    uint16_t field;

    memcpy(&field, at, 2);
    field = (uint16_t)((field & 0xfc00) | len);
    memcpy(at, &field, 2);
}

static uint32_t
room_of(uint32_t field)
{
    uint32_t blocks = (field >> 10) & 31;

    return field & 0x8000 ? 32 * (blocks + 1) : 2 * blocks;
}

/*
 * Registers
 */

static void
update_irq(void)
{
    uint32_t i, ctr = 0;

    for (i = 0; i < 8; i++)
        ctr |= dev->regs[i] & (CTR_RX | CTR_TX);
    dev->regs[ISTR] = (dev->regs[ISTR] & 0x7fffu) | (ctr ? 0x8000u : 0);
    core_set_level(16u + dev->info->irq,
                   dev->regs[ISTR] & dev->regs[CNTR] & 0xff00);
}

static void
write_endpoint(uint32_t ep, uint32_t value)
{
    uint32_t toggles = 3u << 12 | DTOG_RX | 3u << 4 | DTOG_TX;
    uint32_t flags = CTR_RX | CTR_TX, old = dev->regs[ep];

    dev->regs[ep] = (value & 0x070f) | (old & SETUP)
        | (old & value & flags) | ((old ^ value) & toggles);
}

void
usbfs_write(struct device *d, uint32_t word, uint32_t value)
{
    if (word < 8)
        write_endpoint(word, value);
    else if (word == ISTR)
        d->regs[ISTR] &= value;
    else
        d->regs[word] = value;
    if (word == CNTR && value & FRES)
        memset(d->regs, 0, 8 * sizeof(d->regs[0]));
    if (word == BCDR || word == CNTR)
        chip_wake_at(chip.cycle);
    update_irq();
}

/*
 * What the host sees
 */

/* An F103 is seen by the board's pull-up, unless the pin is held low while the
 * transceiver is off. */
static bool
has_pull_up(void)
{
    const struct device *port;
    int8_t pull;

    if (chip.model->line != LINE_F1)
        return dev->regs[BCDR] & 0x8000;
    if (!(dev->regs[CNTR] & PDWN))
        return true;
    port = stm32_find(DEV_GPIO, 0);
    return gpio_mode_of(port, 12, &pull) != 1 || port->out & (1u << 12);
}

static bool
is_attached(void)
{
    bool on = rcc_has_clock(dev) && has_pull_up()
        && !(dev->regs[CNTR] & (FRES | PDWN));

    if (on)
        stm32_check_usb_clock();
    return on;
}

static void
reset_bus(void)
{
    uint32_t i;

    for (i = 0; i < 8; i++)
        dev->regs[i] = 0;
    dev->regs[DADDR] = 0;
    dev->regs[ISTR] |= RESET;
    update_irq();
}

/* The register of the endpoint with this number; -1: none. */
static int
find_endpoint(uint32_t number, bool is_in)
{
    int i;

    for (i = 0; i < 8; i++) {
        uint32_t epr = dev->regs[i];

        if ((epr & EA) == number
            && (is_in ? STAT_TX(epr) : STAT_RX(epr)) != DISABLED)
            return i;
    }
    return -1;
}

static void
store(uint32_t ep, const struct usb_packet *packet)
{
    uint32_t field, at = read_entry(ep, 1, &field);

    if (packet->len > room_of(field) || at + packet->len > memory_size())
        chip_fault("%u bytes for endpoint %u, which has room for %u",
                   packet->len, ep, room_of(field));
    else
        memcpy(&memory[at], packet->data, packet->len);
    write_count(ep, packet->len);
}

/* A setup packet is taken in any state, but not while one waits. */
static enum usb_answer
take_setup(uint32_t ep, const struct usb_packet *packet)
{
    uint32_t *epr = &dev->regs[ep];

    if (*epr & CTR_RX || STAT_RX(*epr) == DISABLED)
        return ANSWER_NOTHING;
    store(ep, packet);
    *epr = (*epr & 0x070f) | CTR_RX | SETUP | DTOG_RX | DTOG_TX
        | NAK << 12 | NAK << 4 | (*epr & CTR_TX);
    update_irq();
    return ANSWER_ACK;
}

static enum usb_answer
take(uint32_t ep, const struct usb_packet *packet)
{
    uint32_t *epr = &dev->regs[ep];

    if (STAT_RX(*epr) == STALL)
        return ANSWER_STALL;
    if (STAT_RX(*epr) != VALID)
        return ANSWER_NAK;
    if (packet->pid != (*epr & DTOG_RX ? 1u : 0u))
        return ANSWER_ACK;      /* it was there before */
    store(ep, packet);
    *epr = ((*epr ^ DTOG_RX) & ~(uint32_t)(SETUP | 3 << 12)) | NAK << 12
        | CTR_RX;
    update_irq();
    return ANSWER_ACK;
}

static enum usb_answer
give(uint32_t ep, struct usb_packet *packet)
{
    uint32_t *epr = &dev->regs[ep], at;

    if (STAT_TX(*epr) == STALL)
        return ANSWER_STALL;
    if (STAT_TX(*epr) != VALID)
        return ANSWER_NAK;
    at = read_entry(ep, 0, &packet->len);
    packet->len &= 0x3ff;
    packet->pid = *epr & DTOG_TX ? 1 : 0;
    if (packet->len > 64 || at + packet->len > memory_size())
        chip_fault("endpoint %u sends %u bytes", ep, packet->len);
    else
        memcpy(packet->data, &memory[at], packet->len);
    *epr = ((*epr ^ DTOG_TX) & ~(uint32_t)(3 << 4)) | NAK << 4 | CTR_TX;
    update_irq();
    return ANSWER_ACK;
}

static enum usb_answer
transact(enum usb_token token, uint32_t address, uint32_t endpoint,
         struct usb_packet *packet)
{
    int ep = find_endpoint(endpoint, token == TOKEN_IN);

    if (!is_attached() || dev->regs[DADDR] != (0x80 | address) || ep < 0)
        return ANSWER_NOTHING;
    if (token == TOKEN_SETUP)
        return take_setup((uint32_t)ep, packet);
    return token == TOKEN_IN ? give((uint32_t)ep, packet)
        : take((uint32_t)ep, packet);
}

void
usbfs_reset(struct device *d)
{
    static const struct usb_controller controller = {
        .is_attached = is_attached, .reset_bus = reset_bus,
        .transact = transact,
    };

    dev = d;
    memset(memory, 0xa5, sizeof(memory));
    d->regs[CNTR] = FRES | PDWN;
    usbhost_start(&controller);
}
