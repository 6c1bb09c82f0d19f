/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * USB device port of SAM4S and SAM4E (11100, chapter 40), and the commands of
 * their flash controller (11100, chapter 20).
 */
#include <string.h>

#include "unicorn_sam.h"
#include "unicorn_usbhost.h"

enum { GLB_STAT = 4, FADDR = 8, IER = 0x10, IDR = 0x14, IMR = 0x18, ISR = 0x1c,
       ICR = 0x20, RST_EP = 0x28, CSR = 0x30, FDR = 0x50, TXVC = 0x74 };
enum { TXCOMP = 1, BK0 = 2, RXSETUP = 4, STALLSENT = 8, TXPKTRDY = 0x10,
       FORCESTALL = 0x20, BK1 = 0x40, DIR = 0x80, EPEDS = 1 << 15,
       BUS_RESET = 1 << 12 };
enum { FLAGS = TXCOMP | BK0 | RXSETUP | STALLSENT | BK1, N_ENDPOINTS = 4 };

/* Two buffers for what comes in; one for what goes out. */
static struct endpoint {
    struct usb_packet in[2], out;
    uint32_t bank, n_full, pid_in, pid_out, pos;
} endpoints[N_ENDPOINTS];

static struct device *
udp(void)
{
    return bus_find(SAM_UDP, 0);
}

static uint32_t *
csr_of(uint32_t endpoint)
{
    return &udp()->regs[CSR / 4 + endpoint];
}

static void
update_irq(struct device *d)
{
    uint32_t i, bits = d->regs[ISR / 4] & BUS_RESET;

    for (i = 0; i < N_ENDPOINTS; i++)
        if (d->regs[CSR / 4 + i] & FLAGS)
            bits |= 1u << i;
    d->regs[ISR / 4] = bits;
    core_set_level(16u + d->info->irq,
                   bits & (d->regs[IMR / 4] | BUS_RESET));
}

/* Endpoints 1 and 2 have two buffers. */
static uint32_t
room_of(uint32_t endpoint)
{
    return endpoint == 1 || endpoint == 2 ? 2 : 1;
}

/*
 * Packets
 */

static bool
is_attached(void)
{
    uint32_t usb = bus_find(SAM_PMC, 0)->regs[0x38 / 4];
    bool on = udp()->regs[TXVC / 4] & 1u << 9
        && !(udp()->regs[TXVC / 4] & 1u << 8);

    if (on && (sam_pll_hz() / ((usb >> 8 & 15) + 1) != 48000000
               || usb & 1 || !(bus_find(SAM_PMC, 0)->regs[2] & 1u << 7)))
        chip_fault("USB without its 48 MHz");
    return on;
}

static void
reset_bus(void)
{
    struct device *d = udp();

    memset(&d->regs[CSR / 4], 0, 8 * 4);
    memset(endpoints, 0, sizeof(endpoints));
    d->regs[FADDR / 4] = 1 << 8;
    d->regs[ISR / 4] |= BUS_RESET;
    update_irq(d);
}

static void
receive(uint32_t endpoint, const struct usb_packet *packet, uint32_t flag)
{
    struct endpoint *e = &endpoints[endpoint];
    uint32_t bank = room_of(endpoint) == 2 ? (e->bank + e->n_full) & 1 : 0;
    uint32_t *csr = csr_of(endpoint);

    if (!flag)
        flag = bank ? BK1 : BK0;
    e->in[bank] = *packet;
    if (!e->n_full++) {
        e->pos = 0;
        *csr = (*csr & 0xffff) | packet->len << 16;
    }
    *csr |= flag;
    update_irq(udp());
}

static enum usb_answer
take_setup(const struct usb_packet *packet)
{
    struct endpoint *e = &endpoints[0];

    e->n_full = 0;
    e->pid_in = e->pid_out = 1;
    *csr_of(0) &= ~(uint32_t)(BK0 | TXPKTRDY);
    receive(0, packet, RXSETUP);
    return ANSWER_ACK;
}

static enum usb_answer
give(uint32_t endpoint, struct usb_packet *packet)
{
    struct endpoint *e = &endpoints[endpoint];
    uint32_t *csr = csr_of(endpoint);

    if (!(*csr & TXPKTRDY))
        return ANSWER_NAK;
    if (!endpoint && e->out.len && !(*csr & DIR))
        chip_fault("USB: endpoint 0 sends against its direction");
    *packet = e->out;
    packet->pid = e->pid_out;
    e->pid_out ^= 1;
    e->out.len = 0;
    *csr = (*csr & ~(uint32_t)TXPKTRDY) | TXCOMP;
    update_irq(udp());
    return ANSWER_ACK;
}

static enum usb_answer
take(uint32_t endpoint, const struct usb_packet *packet)
{
    struct endpoint *e = &endpoints[endpoint];

    if (e->n_full == room_of(endpoint) || *csr_of(endpoint) & RXSETUP)
        return ANSWER_NAK;
    if (packet->pid != e->pid_in)
        chip_fault("USB endpoint %u expects another packet", endpoint);
    e->pid_in ^= 1;
    receive(endpoint, packet, 0);
    return ANSWER_ACK;
}

static enum usb_answer
transact(enum usb_token token, uint32_t address, uint32_t endpoint,
         struct usb_packet *packet)
{
    uint32_t faddr = udp()->regs[FADDR / 4];

    if (!is_attached() || (faddr & 0x17f) != (0x100 | address)
        || endpoint >= N_ENDPOINTS || !(*csr_of(endpoint) & EPEDS)
        || (endpoint && !(udp()->regs[GLB_STAT / 4] & 2)))
        return ANSWER_NOTHING;
    if (token == TOKEN_SETUP)
        return take_setup(packet);
    if (*csr_of(endpoint) & FORCESTALL) {
        *csr_of(endpoint) |= STALLSENT;
        update_irq(udp());
        return ANSWER_STALL;
    }
    return token == TOKEN_IN ? give(endpoint, packet) : take(endpoint, packet);
}

static const struct usb_controller controller = {
    .is_attached = is_attached, .reset_bus = reset_bus, .transact = transact,
};

/*
 * Registers
 */

/* A buffer was given back: the other one is next. */
static void
drop_packet(uint32_t endpoint, uint32_t *csr)
{
    struct endpoint *e = &endpoints[endpoint];

    if (e->n_full)
        e->n_full--;
    if (room_of(endpoint) == 2)
        e->bank ^= 1;
    e->pos = 0;
    *csr = (*csr & 0xffff) | (e->n_full ? e->in[e->bank].len << 16 : 0);
}

static void
write_csr(uint32_t endpoint, uint32_t value)
{
    uint32_t *csr = csr_of(endpoint), cleared = *csr & FLAGS & ~value;
    uint32_t first = endpoints[endpoint].bank ? BK1 : BK0;

    if (cleared & RXSETUP && !endpoint
        && !(value & DIR) != !(endpoints[0].in[0].data[0] & 0x80))
        chip_fault("USB: the direction must be known before RXSETUP ends");
    if (cleared & (BK0 | BK1) & ~first && room_of(endpoint) == 2)
        chip_fault("USB endpoint %u: the other buffer was first", endpoint);
    *csr = (*csr & (FLAGS | 0x7ff0000u) & ~cleared)
        | (value & (TXPKTRDY | FORCESTALL | DIR | 0x700 | EPEDS));
    if (cleared & (BK0 | BK1 | RXSETUP))
        drop_packet(endpoint, csr);
}

static uint32_t
read_byte(uint32_t endpoint)
{
    struct endpoint *e = &endpoints[endpoint];
    const struct usb_packet *packet = &e->in[e->bank];

    if (!e->n_full || e->pos >= packet->len) {
        chip_fault("USB endpoint %u has no more bytes", endpoint);
        return 0;
    }
    return packet->data[e->pos++];
}

static void
write_byte(uint32_t endpoint, uint32_t value)
{
    struct endpoint *e = &endpoints[endpoint];

    if (*csr_of(endpoint) & TXPKTRDY || e->out.len == sizeof(e->out.data))
        chip_fault("USB endpoint %u is full", endpoint);
    else
        e->out.data[e->out.len++] = (uint8_t)value;
}

static uint32_t
udp_read(struct device *d, uint32_t offset)
{
    if (offset >= FDR && offset < FDR + 4 * N_ENDPOINTS)
        return read_byte((offset - FDR) / 4);
    return d->regs[offset / 4];
}

static void
udp_write(struct device *d, uint32_t offset, uint32_t value)
{
    if (offset == IER) {
        d->regs[IMR / 4] |= value;
    } else if (offset == IDR) {
        d->regs[IMR / 4] &= ~value;
    } else if (offset == ICR) {
        d->regs[ISR / 4] &= ~value;
    } else if (offset >= CSR && offset < CSR + 4 * N_ENDPOINTS) {
        write_csr((offset - CSR) / 4, value);
    } else if (offset >= FDR && offset < FDR + 4 * N_ENDPOINTS) {
        write_byte((offset - FDR) / 4, value);
    } else {
        d->regs[offset / 4] = value;
        chip_wake_at(chip.cycle);
    }
    update_irq(d);
}

static void
udp_reset(struct device *d)
{
    memset(endpoints, 0, sizeof(endpoints));
    d->regs[TXVC / 4] = 1 << 8;
    usbhost_start(&controller);
}

const struct device_ops sam_udp_ops = {
    udp_reset, udp_read, udp_write, NULL,
};

bool
sam_uses_usb(void)
{
    return sam_usbhs_is_used()
        || (udp() && udp()->regs[TXVC / 4] & 1u << 9);
}

/*
 * Commands of the flash controller
 */

static uint8_t hidden[16];
static bool shows_id;

void
sam_flash_command(struct device *d, uint32_t word)
{
    static const uint8_t id[16] = "SAM4 emulated id";
    uint32_t pc;

    uc_reg_read(chip.uc, UC_ARM_REG_PC, &pc);
    if (word >> 24 != 0x5a)
        chip_fault("flash command without its key");
    if (pc - chip.model->family->flash_base < chip.model->flash_size)
        chip_fault("flash command by a program in flash");
    d->shift = 0;
    if ((word & 0xff) == 0x0e && !shows_id) {
        memcpy(hidden, chip.flash, sizeof(hidden));
        memcpy(chip.flash, id, sizeof(hidden));
        shows_id = true;
        d->shift = 1;
    } else if ((word & 0xff) == 0x0f && shows_id) {
        memcpy(chip.flash, hidden, sizeof(hidden));
        shows_id = false;
    } else if ((word & 0xffffff) == 0x10c) {
        chip.wants_bootloader = true;
    } else {
        chip_fault("flash command 0x%x", word & 0xff);
    }
}
