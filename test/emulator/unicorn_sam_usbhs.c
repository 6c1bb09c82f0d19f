/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * USB controller of SAM3X and SAM E70, as a device (11057, chapter 39).
 */
#include <string.h>

#include "unicorn_sam.h"
#include "unicorn_usbhost.h"

enum { DEVCTRL = 0, DEVISR = 4, DEVICR = 8, DEVIMR = 0x10, DEVIDR = 0x14,
       DEVIER = 0x18, DEVEPT = 0x1c, CFG = 0x100, EPT_ISR = 0x130,
       EPT_ICR = 0x160, EPT_IMR = 0x1c0, EPT_IER = 0x1f0, EPT_IDR = 0x220 };
enum { TXIN = 1, RXOUT = 2, RXSTP = 4, FIFOCON = 1 << 14, STALLRQ = 1 << 19,
       EORST = 8, N_ENDPOINTS = 4, ALLOC = 2, IS_IN = 1 << 8 };

/* Buffers in order; `flags` are TXIN, RXOUT, RXSTP; `fill` is being written,
 * `pos` was read. */
static struct endpoint {
    struct usb_packet banks[2], fill;
    uint32_t n_full, pos, flags, pid_in, pid_out;
} endpoints[N_ENDPOINTS];

static struct device *
usb(void)
{
    return bus_find(SAM_USBHS, 0);
}

static uint32_t
reg_of(uint32_t base, uint32_t endpoint)
{
    return usb()->regs[base / 4 + endpoint];
}

static uint32_t
room_of(uint32_t endpoint)
{
    return reg_of(CFG, endpoint) & 4 ? 2 : 1;
}

static uint32_t
size_of(uint32_t endpoint)
{
    return 8u << (reg_of(CFG, endpoint) >> 4 & 7);
}

static void
update_irq(struct device *d)
{
    uint32_t i, bits = d->regs[DEVISR / 4] & EORST;

    for (i = 0; i < N_ENDPOINTS; i++)
        if (endpoints[i].flags & reg_of(EPT_IMR, i))
            bits |= 1u << (12 + i);
    core_set_level(16u + d->info->irq, bits & d->regs[DEVIMR / 4]);
}

/*
 * Packets
 */

static bool
is_attached(void)
{
    const uint32_t *pmc = bus_find(SAM_PMC, 0)->regs;
    uint32_t control = bus_find(SAM_USBHS_CTRL, 0)->regs[0];
    bool on = (control & (1u << 15 | 1u << 14)) == 1u << 15
        && !(usb()->regs[DEVCTRL / 4] & 1u << 8);

    if (on && ((pmc[0x38 / 4] & 0xf01) != 0x901 || !(pmc[0x1c / 4] & 1u << 16)
               || !(pmc[2] & 1u << 5)))
        chip_fault("USB without its 48 MHz");
    if (on && (usb()->regs[DEVCTRL / 4] >> 10 & 3) != 3)
        chip_fault("USB at high speed");
    return on;
}

static void
reset_bus(void)
{
    struct device *d = usb();

    memset(endpoints, 0, sizeof(endpoints));
    memset(&d->regs[CFG / 4], 0, N_ENDPOINTS * 4);
    memset(&d->regs[EPT_IMR / 4], 0, N_ENDPOINTS * 4);
    d->regs[DEVCTRL / 4] &= ~0xffu;
    d->regs[DEVISR / 4] |= EORST;
    update_irq(d);
}

static enum usb_answer
take_setup(const struct usb_packet *packet)
{
    struct endpoint *e = &endpoints[0];

    e->banks[0] = *packet;
    e->n_full = 1;
    e->pos = 0;
    e->fill.len = 0;
    e->pid_in = e->pid_out = 1;
    e->flags = RXSTP | TXIN;
    usb()->regs[EPT_IMR / 4] &= ~(uint32_t)STALLRQ;
    update_irq(usb());
    return ANSWER_ACK;
}

/* Of endpoint 0, what goes out lies in the second buffer. */
static enum usb_answer
give(uint32_t endpoint, struct usb_packet *packet)
{
    struct endpoint *e = &endpoints[endpoint];

    if (endpoint ? !e->n_full : !(e->flags & 8))
        return ANSWER_NAK;
    *packet = e->banks[endpoint ? 0 : 1];
    packet->pid = e->pid_out;
    e->pid_out ^= 1;
    if (endpoint) {
        e->banks[0] = e->banks[1];
        e->n_full--;
    }
    e->flags = (e->flags & ~8u) | TXIN;
    update_irq(usb());
    return ANSWER_ACK;
}

static enum usb_answer
take(uint32_t endpoint, const struct usb_packet *packet)
{
    struct endpoint *e = &endpoints[endpoint];

    if (e->n_full == room_of(endpoint) || e->flags & RXSTP)
        return ANSWER_NAK;
    if (packet->pid != e->pid_in || packet->len > size_of(endpoint))
        chip_fault("USB endpoint %u expects another packet", endpoint);
    e->pid_in ^= 1;
    e->banks[e->n_full++] = *packet;
    if (e->n_full == 1) {
        e->pos = 0;
        e->flags |= RXOUT;
    }
    update_irq(usb());
    return ANSWER_ACK;
}

static enum usb_answer
transact(enum usb_token token, uint32_t address, uint32_t endpoint,
         struct usb_packet *packet)
{
    uint32_t control = usb()->regs[DEVCTRL / 4];

    if (!is_attached() || (control & 0xff) != (0x80 | address)
        || endpoint >= N_ENDPOINTS || !(reg_of(CFG, endpoint) & ALLOC)
        || !(usb()->regs[DEVEPT / 4] & 1u << endpoint))
        return ANSWER_NOTHING;
    if (token == TOKEN_SETUP)
        return take_setup(packet);
    if (reg_of(EPT_IMR, endpoint) & STALLRQ)
        return ANSWER_STALL;
    return token == TOKEN_IN ? give(endpoint, packet) : take(endpoint, packet);
}

static const struct usb_controller controller = {
    .is_attached = is_attached, .reset_bus = reset_bus, .transact = transact,
};

/*
 * Buffers
 */

static uint64_t
fifo_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    struct endpoint *e = &endpoints[(offset >> 15) % N_ENDPOINTS];

    (void)uc;
    (void)param;
    if (size != 1 || !e->n_full || e->pos >= e->banks[0].len) {
        chip_fault("USB endpoint %u has no more bytes",
                   (uint32_t)offset >> 15);
        return 0;
    }
    return e->banks[0].data[e->pos++];
}

static void
fifo_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
           void *param)
{
    uint32_t endpoint = (uint32_t)(offset >> 15) % N_ENDPOINTS;
    struct endpoint *e = &endpoints[endpoint];

    (void)uc;
    (void)param;
    if (size != 1 || e->fill.len >= size_of(endpoint))
        chip_fault("USB endpoint %u is full", endpoint);
    else
        e->fill.data[e->fill.len++] = (uint8_t)value;
}

void
sam_usbhs_map(uc_engine *uc, uint32_t memory)
{
    if (uc_mmio_map(uc, memory, 0x50000, fifo_read, NULL, fifo_write, NULL))
        chip_fault("no USB memory");
}

/* What was written goes out; 8 in the flags: that of endpoint 0 is full. */
static void
send_filled(uint32_t endpoint)
{
    struct endpoint *e = &endpoints[endpoint];

    if (endpoint && e->n_full == room_of(endpoint))
        chip_fault("USB endpoint %u: no free buffer", endpoint);
    else
        e->banks[endpoint ? e->n_full++ : 1] = e->fill;
    e->fill.len = 0;
    if (!endpoint)
        e->flags |= 8;
    else if (e->n_full < room_of(endpoint))
        e->flags |= TXIN;
}

static void
drop_received(uint32_t endpoint)
{
    struct endpoint *e = &endpoints[endpoint];

    if (!e->n_full)
        return;
    e->banks[0] = e->banks[1];
    e->n_full--;
    e->pos = 0;
    if (e->n_full)
        e->flags |= RXOUT;
}

/* Endpoint 0 has no FIFOCON: to clear a flag is enough. */
static void
clear_flags(uint32_t endpoint, uint32_t bits)
{
    uint32_t cleared = endpoints[endpoint].flags & bits & 7;

    endpoints[endpoint].flags &= ~cleared;
    if (!endpoint && cleared & (RXOUT | RXSTP))
        drop_received(0);
    if (!endpoint && cleared & TXIN)
        send_filled(0);
}

static void
give_buffer(uint32_t endpoint)
{
    if (endpoints[endpoint].flags
        & (reg_of(CFG, endpoint) & IS_IN ? TXIN : RXOUT))
        chip_fault("USB endpoint %u: FIFOCON before the flag", endpoint);
    if (reg_of(CFG, endpoint) & IS_IN)
        send_filled(endpoint);
    else
        drop_received(endpoint);
}

/*
 * Registers
 */

static uint32_t
usb_read(struct device *d, uint32_t offset)
{
    uint32_t i = (offset - EPT_ISR) / 4;
    const struct endpoint *e;

    if (offset < EPT_ISR || i >= N_ENDPOINTS)
        return d->regs[offset / 4];
    e = &endpoints[i];
    return (e->flags & 7) | (reg_of(CFG, i) & ALLOC ? 1u << 18 : 0)
        | (e->n_full ? e->banks[0].len - e->pos : 0) << 20;
}

static void
write_config(struct device *d, uint32_t endpoint, uint32_t value)
{
    d->regs[CFG / 4 + endpoint] = value;
    endpoints[endpoint] = (struct endpoint) { .n_full = 0 };
    if (!endpoint || value & IS_IN)
        endpoints[endpoint].flags = TXIN;
    if (!(d->regs[DEVEPT / 4] & 1u << endpoint))
        chip_fault("USB endpoint %u is off", endpoint);
}

static void
write_endpoint(struct device *d, uint32_t base, uint32_t endpoint,
               uint32_t value)
{
    if (base == CFG)
        write_config(d, endpoint, value);
    else if (base == EPT_ICR)
        clear_flags(endpoint, value);
    else if (base == EPT_IER)
        d->regs[EPT_IMR / 4 + endpoint] |= value;
    else if (base == EPT_IDR)
        d->regs[EPT_IMR / 4 + endpoint] &= ~value;
    if (base == EPT_IDR && value & FIFOCON)
        give_buffer(endpoint);
}

static void
usb_write(struct device *d, uint32_t offset, uint32_t value)
{
    if (!(bus_find(SAM_USBHS_CTRL, 0)->regs[0] & 1u << 15))
        chip_fault("USB is off");
    if (offset == DEVICR)
        d->regs[DEVISR / 4] &= ~value;
    else if (offset == DEVIER)
        d->regs[DEVIMR / 4] |= value;
    else if (offset == DEVIDR)
        d->regs[DEVIMR / 4] &= ~value;
    else if (offset < CFG)
        d->regs[offset / 4] = value;
    else if ((offset - CFG) % 0x30 / 4 < N_ENDPOINTS)
        write_endpoint(d, CFG + (offset - CFG) / 0x30 * 0x30,
                       (offset - CFG) % 0x30 / 4, value);
    chip_wake_at(chip.cycle);
    update_irq(d);
}

static void
usb_reset(struct device *d)
{
    memset(endpoints, 0, sizeof(endpoints));
    d->regs[DEVCTRL / 4] = 1 << 8;
    usbhost_start(&controller);
}

const struct device_ops sam_usbhs_ops = {
    usb_reset, usb_read, usb_write, NULL,
};

/* CTRL and SR: the clock is usable while it is not frozen. */
static uint32_t
control_read(struct device *d, uint32_t offset)
{
    return offset == 4 ? ~d->regs[0] & 1u << 14 : d->regs[offset / 4];
}

static void
control_reset(struct device *d)
{
    d->regs[0] = 0x03004000;
}

const struct device_ops sam_usbhs_ctrl_ops = {
    control_reset, control_read, NULL, NULL,
};

bool
sam_usbhs_is_used(void)
{
    return usb() && !(usb()->regs[DEVCTRL / 4] & 1u << 8);
}
