/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * USB device of an LPC176x (UM10360, chapter 11): its interface engine, the
 * buffers of endpoints 0 to 2, and what it answers to packets.
 */
#include <string.h>

#include "unicorn_lpc.h"
#include "unicorn_usbhost.h"

enum { DEV_INT_ST = 0, DEV_INT_EN = 4, DEV_INT_CLR = 8, CMD_CODE = 0x10,
       CMD_DATA = 0x14, RX_DATA = 0x18, TX_DATA = 0x1c, RX_PLEN = 0x20,
       TX_PLEN = 0x24, CTRL = 0x28, EP_INT_ST = 0x30, EP_INT_EN = 0x34,
       EP_INT_CLR = 0x38, RE_EP = 0x44, EP_IND = 0x48, MAX_P_SIZE = 0x4c };
enum { EP_SLOW = 4, DEV_STAT = 8, CCEMPTY = 0x10, CDFULL = 0x20,
       EP_RLZED = 0x100, PKT_RDY = 1 << 11, DV = 1 << 10 };
enum { N_ENDPOINTS = 6, STATUS_RESET = 0x10 };

/* Buffers of an endpoint and direction; the first one is next. */
static struct endpoint {
    struct usb_packet packets[2];
    uint32_t n_full, size, pid;
    bool is_stalled, is_setup, is_overwritten;
} endpoints[N_ENDPOINTS];

static struct {
    uint32_t address, status, code, selected, pos, n_words;
    bool is_enabled, is_configured;
    struct usb_packet out;      /* being written */
} engine;

static struct device *
usb(void)
{
    return bus_find(LPC_USB, 0);
}

static void
update_irq(struct device *d)
{
    core_set_level(16u + d->info->irq,
                   d->regs[DEV_INT_ST / 4] & d->regs[DEV_INT_EN / 4]
                   && bus_find(LPC_SYSCON, 0)->regs[0x1c0 / 4] >> 31);
}

/* Bulk endpoints have two buffers. */
static uint32_t
room_of(uint32_t endpoint)
{
    return endpoint >= 4 ? 2 : 1;
}

static void
note_endpoint(uint32_t endpoint)
{
    struct device *d = usb();

    if (d->regs[EP_INT_EN / 4] & 1u << endpoint) {
        d->regs[EP_INT_ST / 4] |= 1u << endpoint;
        d->regs[DEV_INT_ST / 4] |= EP_SLOW;
    }
    update_irq(d);
}

static void
drop_first(struct endpoint *e)
{
    if (!e->n_full) {
        chip_fault("USB: there is no packet to be cleared");
        return;
    }
    e->packets[0] = e->packets[1];
    e->n_full--;
}

/*
 * Packets
 */

static bool
is_attached(void)
{
    bool on = engine.status & 1 && lpc_function_of(29) == 1
        && lpc_function_of(30) == 1 && lpc_function_of(73) == 1;

    if (on && !lpc_has_usb_clock())
        chip_fault("USB without its 48 MHz");
    return on;
}

static void
reset_bus(void)
{
    memset(endpoints, 0, sizeof(endpoints));
    engine.address = 0;
    engine.is_configured = false;
    engine.status |= STATUS_RESET;
    usb()->regs[RE_EP / 4] = 3;
    usb()->regs[EP_INT_ST / 4] = 0;
    usb()->regs[DEV_INT_ST / 4] |= DEV_STAT;
    update_irq(usb());
}

/* Takes the place of whatever was there, and ends a stall. */
static enum usb_answer
take_setup(const struct usb_packet *packet)
{
    struct endpoint *e = &endpoints[0];

    e->is_overwritten = e->n_full;
    e->packets[0] = *packet;
    e->n_full = 1;
    e->is_setup = true;
    e->pid = 1;
    endpoints[1].pid = 1;
    endpoints[0].is_stalled = endpoints[1].is_stalled = false;
    note_endpoint(0);
    return ANSWER_ACK;
}

static enum usb_answer
take(uint32_t endpoint, const struct usb_packet *packet)
{
    struct endpoint *e = &endpoints[endpoint];

    if (e->n_full == room_of(endpoint))
        return ANSWER_NAK;
    if (packet->len > e->size || packet->pid != e->pid)
        chip_fault("USB endpoint %u expects another packet", endpoint);
    e->packets[e->n_full++] = *packet;
    e->pid ^= 1;
    e->is_setup = false;
    note_endpoint(endpoint);
    return ANSWER_ACK;
}

static enum usb_answer
give(uint32_t endpoint, struct usb_packet *packet)
{
    struct endpoint *e = &endpoints[endpoint];

    if (!e->n_full)
        return ANSWER_NAK;
    *packet = e->packets[0];
    packet->pid = e->pid;
    e->pid ^= 1;
    drop_first(e);
    note_endpoint(endpoint);
    return ANSWER_ACK;
}

static enum usb_answer
transact(enum usb_token token, uint32_t address, uint32_t number,
         struct usb_packet *packet)
{
    uint32_t endpoint = 2 * number + (token == TOKEN_IN);

    if (!is_attached() || !engine.is_enabled || engine.address != address
        || endpoint >= N_ENDPOINTS
        || !(usb()->regs[RE_EP / 4] & 1u << endpoint)
        || (number && !engine.is_configured))
        return ANSWER_NOTHING;
    if (token == TOKEN_SETUP)
        return take_setup(packet);
    if (endpoints[endpoint].is_stalled)
        return ANSWER_STALL;
    return token == TOKEN_IN ? give(endpoint, packet) : take(endpoint, packet);
}

static const struct usb_controller controller = {
    .is_attached = is_attached, .reset_bus = reset_bus, .transact = transact,
};

/*
 * The engine
 */

static uint32_t
selection_of(uint32_t endpoint)
{
    const struct endpoint *e = &endpoints[endpoint];
    bool is_in = endpoint & 1;

    /* of an input: is there no room for another packet? */
    return (is_in ? e->n_full == room_of(endpoint) : e->n_full > 0)
        | (e->is_stalled ? 2u : 0) | (e->is_setup ? 4u : 0);
}

/* Does nothing but choose; or acts on what is chosen. */
static void
run_command(uint32_t code)
{
    struct endpoint *e = &endpoints[engine.selected];

    engine.code = code;
    if (code < N_ENDPOINTS)
        engine.selected = code;
    if (code == 0xfa) {
        if (e->n_full == room_of(engine.selected) || !(engine.selected & 1))
            chip_fault("USB endpoint %u: no buffer to be sent",
                       engine.selected);
        if (engine.out.len > e->size || 4 * engine.n_words < engine.out.len)
            chip_fault("USB packet of %u bytes in %u words", engine.out.len,
                       engine.n_words);
        e->packets[e->n_full++ & 1] = engine.out;
    }
}

static uint32_t
read_result(void)
{
    struct endpoint *e = &endpoints[engine.selected];
    uint32_t value = 0;

    if (engine.code < N_ENDPOINTS)
        return selection_of(engine.code);
    if (engine.code == 0xfe) {
        value = engine.status;
        engine.status &= ~(uint32_t)STATUS_RESET;
    } else if (engine.code == 0xf2) {
        value = e->is_overwritten;
        if (!value)
            drop_first(e);
        e->is_overwritten = false;
    } else {
        chip_fault("USB: command 0x%x tells nothing", engine.code);
    }
    return value;
}

static void
write_value(uint32_t value)
{
    if (engine.code == 0xd0) {
        engine.address = value & 127;
        engine.is_enabled = value & 128;
    } else if (engine.code == 0xd8) {
        engine.is_configured = value & 1;
    } else if (engine.code == 0xfe) {
        engine.status = (engine.status & ~1u) | (value & 1);
        chip_wake_at(chip.cycle);
    } else if (engine.code - 0x40 < N_ENDPOINTS) {
        struct endpoint *e = &endpoints[engine.code - 0x40];

        e->is_stalled = value & 1;
        if (!e->is_stalled)
            e->n_full = e->pid = 0;
    } else if (engine.code != 0xf3) {
        chip_fault("USB: command 0x%x takes nothing", engine.code);
    }
}

static void
write_code(struct device *d, uint32_t word)
{
    uint32_t phase = word >> 8 & 255, value = word >> 16 & 255;

    if (phase == 5)
        run_command(value);
    else if (phase == 1)
        write_value(value);
    else if (phase == 2 && value == engine.code)
        d->regs[CMD_DATA / 4] = read_result();
    else
        chip_fault("USB: command word 0x%x", word);
    d->regs[DEV_INT_ST / 4] |= phase == 2 ? CDFULL : CCEMPTY;
}

/*
 * Registers
 */

static uint32_t
read_data(struct device *d)
{
    const struct endpoint *e = &endpoints[2 * (d->regs[CTRL / 4] >> 2 & 15)];
    uint32_t word;

    if (!(d->regs[CTRL / 4] & 1) || !e->n_full)
        chip_fault("USB: no packet is read");
    memcpy(&word, &e->packets[0].data[engine.pos & 60], 4);
    engine.pos += 4;
    return word;
}

static uint32_t
usb_read(struct device *d, uint32_t offset)
{
    const struct endpoint *e = &endpoints[2 * (d->regs[CTRL / 4] >> 2 & 15)];

    if (offset == RX_DATA)
        return read_data(d);
    if (offset == RX_PLEN)
        return e->n_full ? e->packets[0].len | PKT_RDY | DV : 0;
    return d->regs[offset / 4];
}

static void
clear_endpoints(struct device *d, uint32_t bits)
{
    uint32_t endpoint = (uint32_t)__builtin_ctz(bits | 1u << 31);

    if (bits & (bits - 1) || endpoint >= N_ENDPOINTS)
        chip_fault("USB: one endpoint at a time");
    d->regs[EP_INT_ST / 4] &= ~bits;
    d->regs[CMD_DATA / 4] = selection_of(endpoint);
    endpoints[endpoint].is_setup = endpoints[endpoint].is_overwritten = false;
    d->regs[DEV_INT_ST / 4] |= CDFULL;
}

static void
write_data(struct device *d, uint32_t value)
{
    uint32_t pos = 4 * engine.n_words++;

    if (!(d->regs[CTRL / 4] & 2) || pos >= sizeof(engine.out.data))
        chip_fault("USB: no packet is written");
    else
        memcpy(&engine.out.data[pos], &value, 4);
}

static void
usb_write(struct device *d, uint32_t offset, uint32_t value)
{
    if (bus_find(LPC_USB_CLOCK, 0)->regs[1] != 0x12)
        chip_fault("USB registers without a clock");
    if (offset == DEV_INT_CLR) {
        d->regs[DEV_INT_ST / 4] &= ~value;
    } else if (offset == CMD_CODE) {
        write_code(d, value);
    } else if (offset == EP_INT_CLR) {
        clear_endpoints(d, value);
    } else if (offset == TX_DATA) {
        write_data(d, value);
    } else {
        d->regs[offset / 4] = value;
        if (offset == CTRL && value)
            engine.pos = engine.n_words = 0;
        if (offset == TX_PLEN)
            engine.out.len = value;
        if (offset == MAX_P_SIZE) {
            endpoints[d->regs[EP_IND / 4] % N_ENDPOINTS].size = value;
            d->regs[DEV_INT_ST / 4] |= EP_RLZED;
        }
    }
    update_irq(d);
}

static void
usb_reset(struct device *d)
{
    (void)d;
    memset(endpoints, 0, sizeof(endpoints));
    memset(&engine, 0, sizeof(engine));
    usbhost_start(&controller);
}

const struct device_ops lpc_usb_ops = { usb_reset, usb_read, usb_write, NULL };

/* What is asked for is on at once: status is the word behind control. */
static uint32_t
clock_read(struct device *d, uint32_t offset)
{
    return d->regs[offset == 8 ? 1 : offset / 4];
}

const struct device_ops lpc_usb_clock_ops = { NULL, clock_read, NULL, NULL };

bool
lpc_uses_usb(void)
{
    return engine.status & 1;
}
