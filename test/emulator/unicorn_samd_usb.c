/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The USB device controller of SAM D21 and D5x: registers, and descriptors of
 * banks in memory (DS40001882, 32).
 */
#include <string.h>

#include "unicorn_samd.h"
#include "unicorn_usbhost.h"

enum { CTRLA = 0, CTRLB = 8, DADD = 0xa, INTENCLR = 0x14, INTENSET = 0x18,
       INTFLAG = 0x1c, DESCADD = 0x24, PADCAL = 0x28, EPCFG = 0x100,
       EP_STATUSCLR = 4, EP_STATUSSET = 5, EP_STATUS = 6, EP_INTFLAG = 7,
       EP_INTENCLR = 8, EP_INTENSET = 9 };
enum { EORST = 8, TRCPT0 = 1, TRCPT1 = 2, RXSTP = 0x10, DTGLOUT = 1,
       DTGLIN = 2, STALLRQ0 = 0x10, STALLRQ1 = 0x20, BK0RDY = 0x40,
       BK1RDY = 0x80 };

static uint8_t *
endpoint(uint32_t number)
{
    return &samd.usb->regs[EPCFG + 0x20 * number];
}

static void
update_irq(void)
{
    uint32_t other = samd_get(samd.usb, INTFLAG, 2)
        & samd_get(samd.usb, INTENSET, 2), flags = 0, i;

    for (i = 0; i < 8; i++)
        flags |= endpoint(i)[EP_INTFLAG] & endpoint(i)[EP_INTENSET];
    if (samd.line != SAMD51) {
        core_set_level(16u + samd.usb->info->irq, other || flags);
        return;
    }
    core_set_level(16u + samd.usb->info->irq, other || flags & RXSTP);
    core_set_level(16u + samd.usb->info->irq + 2u, flags & TRCPT0);
    core_set_level(16u + samd.usb->info->irq + 3u, (flags & TRCPT1) != 0);
}

/* Two words of a bank: address, packet size. */
static void
read_bank(uint32_t number, uint32_t bank, uint32_t *words)
{
    uint32_t at = samd_get(samd.usb, DESCADD, 4) + 32 * number + 16 * bank;

    if (uc_mem_read(chip.uc, at, words, 8) || words[0] & 3)
        chip_fault("bank %u of endpoint %u is nowhere", bank, number);
}

static void
write_count(uint32_t number, uint32_t bank, const uint32_t *words, uint32_t len)
{
    uint32_t at = samd_get(samd.usb, DESCADD, 4) + 32 * number + 16 * bank;
    uint32_t size = (words[1] & 0xf0000000) | len;

    if (uc_mem_write(chip.uc, at + 4, &size, 4))
        chip_fault("descriptors are nowhere");
}

static bool
is_attached(void)
{
    bool on = samd_usb_is_on() && !(samd_get(samd.usb, CTRLB, 2) & 1);

    if (!on)
        return false;
    if (samd_feed_hz(samd.usb) != 48000000)
        chip_fault("USB at %u Hz", samd_feed_hz(samd.usb));
    if (samd_mux_of(24) != (samd.line == SAMD51 ? 7 : 6)
        || samd_mux_of(25) != samd_mux_of(24))
        chip_fault("USB has no pins");
    if (!samd_get(samd.usb, PADCAL, 2))
        chip_fault("USB is not calibrated");
    return true;
}

static void
reset_bus(void)
{
    uint32_t i;

    for (i = 0; i < 8; i++)
        memset(endpoint(i), 0, 0x20);
    samd_put(samd.usb, DADD, 1, 0x80);
    samd_put(samd.usb, INTFLAG, 2, samd_get(samd.usb, INTFLAG, 2) | EORST);
    update_irq();
}

static enum usb_answer
take(uint32_t number, const struct usb_packet *packet, bool is_setup)
{
    uint8_t *ep = endpoint(number);
    uint32_t words[2];

    read_bank(number, 0, words);
    if (packet->len > (8u << (words[1] >> 28 & 7))
        || uc_mem_write(chip.uc, words[0], packet->data, packet->len))
        chip_fault("endpoint %u has no room", number);
    if (!is_setup && packet->pid != (ep[EP_STATUS] & DTGLOUT))
        chip_fault("endpoint %u expects another packet", number);
    write_count(number, 0, words, packet->len);
    ep[EP_STATUS] |= BK0RDY;
    if (is_setup) {
        ep[EP_STATUS] &= (uint8_t)~(STALLRQ0 | STALLRQ1);
        ep[EP_STATUS] |= DTGLIN | DTGLOUT;
        ep[EP_INTFLAG] |= RXSTP;
    } else {
        ep[EP_STATUS] ^= DTGLOUT;
        ep[EP_INTFLAG] |= TRCPT0;
    }
    update_irq();
    return ANSWER_ACK;
}

static enum usb_answer
give(uint32_t number, struct usb_packet *packet)
{
    uint8_t *ep = endpoint(number);
    uint32_t words[2];

    read_bank(number, 1, words);
    packet->len = words[1] & 0x3fff;
    packet->pid = ep[EP_STATUS] & DTGLIN ? 1 : 0;
    if (packet->len > (8u << (words[1] >> 28 & 7))
        || uc_mem_read(chip.uc, words[0], packet->data, packet->len))
        chip_fault("endpoint %u gives too much", number);
    ep[EP_STATUS] = (uint8_t)((ep[EP_STATUS] & ~BK1RDY) ^ DTGLIN);
    ep[EP_INTFLAG] |= TRCPT1;
    update_irq();
    return ANSWER_ACK;
}

static enum usb_answer
transact(enum usb_token token, uint32_t address, uint32_t number,
         struct usb_packet *packet)
{
    uint8_t *ep = endpoint(number), type;

    if (!is_attached()
        || samd_get(samd.usb, DADD, 1) != (0x80 | address))
        return ANSWER_NOTHING;
    type = token == TOKEN_IN ? ep[0] >> 4 & 7 : ep[0] & 7;
    if (!type || (token == TOKEN_SETUP && type != 1))
        return ANSWER_NOTHING;
    if (token == TOKEN_SETUP)
        return take(number, packet, true);
    if (ep[EP_STATUS] & (token == TOKEN_IN ? STALLRQ1 : STALLRQ0))
        return ANSWER_STALL;
    if (token == TOKEN_IN)
        return ep[EP_STATUS] & BK1RDY ? give(number, packet) : ANSWER_NAK;
    return ep[EP_STATUS] & BK0RDY ? ANSWER_NAK : take(number, packet, false);
}

static const struct usb_controller controller = {
    .is_attached = is_attached, .reset_bus = reset_bus, .transact = transact,
};

static void
endpoint_write(uint8_t *ep, uint32_t reg, uint8_t value)
{
    if (reg == EP_STATUSCLR)
        ep[EP_STATUS] &= (uint8_t)~value;
    else if (reg == EP_STATUSSET)
        ep[EP_STATUS] |= value;
    else if (reg == EP_INTFLAG)
        ep[EP_INTFLAG] &= (uint8_t)~value;
    else if (reg == EP_INTENCLR)
        ep[EP_INTENSET] &= (uint8_t)~value;
    else if (reg == EP_INTENSET)
        ep[EP_INTENSET] |= value;
    else
        ep[reg] = value;
}

void
samd_usb_write(struct samd_device *d, uint32_t offset, uint32_t size,
               uint32_t value)
{
    uint32_t mask = samd_get(d, INTENSET, 2);

    if (offset >= EPCFG)
        endpoint_write(&d->regs[offset & ~31u], offset & 31, (uint8_t)value);
    else if (offset == CTRLA && value & 1)
        memset(d->regs, 0, sizeof(d->regs)), samd_put(d, CTRLB, 2, 1);
    else if (offset == INTFLAG)
        samd_put(d, INTFLAG, 2, samd_get(d, INTFLAG, 2) & ~value);
    else if (offset == INTENCLR)
        samd_put(d, INTENSET, 2, mask & ~value);
    else if (offset == INTENSET)
        samd_put(d, INTENSET, 2, mask | value);
    else
        samd_put(d, offset, size, value);
    if (offset == CTRLB)
        chip_wake_at(chip.cycle);
    update_irq();
}

void
samd_usb_start(void)
{
    if (samd.usb)
        samd_put(samd.usb, CTRLB, 2, 1);
    usbhost_start(&controller);
}

bool
samd_usb_is_on(void)
{
    return samd.usb && samd_get(samd.usb, CTRLA, 1) & 2;
}
