/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * An RP2040's USB device controller (data sheet, 4.1): its memory, its
 * registers, and what it answers to packets.
 */
#include <string.h>

#include "unicorn_rp2040.h"
#include "unicorn_usbhost.h"

#define MEMORY_BASE 0x50100000u
#define REGS_BASE 0x50110000u
/* Words of the registers */
enum { ADDR_CTRL = 0, MAIN_CTRL = 16, SIE_CTRL = 19, SIE_STATUS = 20,
       BUFF_STATUS = 22, STALL_ARM = 26, MUXING = 29, PWR = 30, INTE = 36,
       INTS = 38, N_REGS = 40 };
/* Bits */
enum { FULL = 1 << 15, DATA1 = 1 << 13, STALL = 1 << 11, AVAILABLE = 1 << 10,
       LENGTH = 0x3ff, SETUP_REC = 1 << 17, BUS_RESET = 1 << 19 };

static uint8_t memory[4096] __attribute__((aligned(4096)));
static uint32_t regs[N_REGS];

/* Word of a buffer's control, and of an endpoint's (1 to 15). */
static uint32_t *
buffer_word(uint32_t endpoint, bool is_out)
{
    return (uint32_t *)&memory[0x80 + 8 * endpoint + 4 * is_out];
}

static uint32_t
control_word(uint32_t endpoint, bool is_out)
{
    return *(uint32_t *)&memory[8 * endpoint + 4 * is_out];
}

static uint32_t
read_ints(void)
{
    return (regs[BUFF_STATUS] ? 1u << 4 : 0)
        | (regs[SIE_STATUS] & BUS_RESET ? 1u << 12 : 0)
        | (regs[SIE_STATUS] & SETUP_REC ? 1u << 16 : 0);
}

static void
update_irq(void)
{
    core_set_level(rp.usb_irq, read_ints() & regs[INTE]);
}

/*
 * Packets
 */

static bool
is_attached(void)
{
    bool on = (regs[MAIN_CTRL] & 5) == 1 && regs[SIE_CTRL] & (1u << 16)
        && (regs[MUXING] & 9) == 9 && (regs[PWR] & 0xc) == 0xc;

    if (on && rp.usb_hz != 48000000)
        chip_fault("USB at %u Hz", rp.usb_hz);
    return on;
}

static void
reset_bus(void)
{
    regs[SIE_STATUS] |= BUS_RESET;
    update_irq();
}

static enum usb_answer
take_setup(const struct usb_packet *packet)
{
    memcpy(memory, packet->data, 8);
    regs[SIE_STATUS] |= SETUP_REC;
    regs[STALL_ARM] = 0;
    update_irq();
    return ANSWER_ACK;
}

/* Where the data of an endpoint lies. */
static uint8_t *
find_data(uint32_t endpoint, bool is_out)
{
    uint32_t offset = 0x100;

    if (endpoint)
        offset = control_word(endpoint, is_out) & 0xffc0;
    if (offset < 0x100 || offset > sizeof(memory) - 64)
        chip_fault("buffer of endpoint %u at 0x%x", endpoint, offset);
    return &memory[offset & (sizeof(memory) - 64)];
}

static void
complete(uint32_t endpoint, bool is_out)
{
    bool tells = endpoint ? control_word(endpoint, is_out) & (1u << 29)
        : regs[SIE_CTRL] & (1u << 29);

    if (tells)
        regs[BUFF_STATUS] |= 1u << (2 * endpoint + is_out);
    update_irq();
}

static enum usb_answer
give(uint32_t endpoint, struct usb_packet *packet)
{
    uint32_t *word = buffer_word(endpoint, false);

    if (!(*word & FULL))
        chip_fault("endpoint %u gives away an empty buffer", endpoint);
    packet->len = *word & LENGTH;
    packet->pid = *word & DATA1 ? 1 : 0;
    memcpy(packet->data, find_data(endpoint, false), packet->len & 127);
    *word &= ~(uint32_t)(FULL | AVAILABLE);
    complete(endpoint, false);
    return ANSWER_ACK;
}

static enum usb_answer
take(uint32_t endpoint, const struct usb_packet *packet)
{
    uint32_t *word = buffer_word(endpoint, true);

    if (packet->len > (*word & LENGTH)
        || packet->pid != (*word & DATA1 ? 1u : 0u))
        chip_fault("endpoint %u expects another packet", endpoint);
    memcpy(find_data(endpoint, true), packet->data, packet->len);
    *word = (*word & ~(uint32_t)(AVAILABLE | LENGTH)) | FULL | packet->len;
    complete(endpoint, true);
    return ANSWER_ACK;
}

static enum usb_answer
transact(enum usb_token token, uint32_t address, uint32_t endpoint,
         struct usb_packet *packet)
{
    bool is_out = token != TOKEN_IN;
    uint32_t word = *buffer_word(endpoint, is_out);

    if (!is_attached() || (regs[ADDR_CTRL] & 127) != address)
        return ANSWER_NOTHING;
    if (token == TOKEN_SETUP)
        return take_setup(packet);
    if (endpoint && !(control_word(endpoint, is_out) & (1u << 31)))
        return ANSWER_NOTHING;
    if (word & STALL && (endpoint || regs[STALL_ARM] & (1u << is_out)))
        return ANSWER_STALL;
    if (!(word & AVAILABLE))
        return ANSWER_NAK;
    return is_out ? take(endpoint, packet) : give(endpoint, packet);
}

static const struct usb_controller controller = {
    .is_attached = is_attached, .reset_bus = reset_bus, .transact = transact,
};

/*
 * Registers
 */

static void
check_reset(void)
{
    if (rp_in_reset(rp.usb_reset))
        chip_fault("USB is held in reset");
}

static uint64_t
regs_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    uint32_t word = (uint32_t)(offset & 0xfff) / 4;

    (void)uc;
    (void)size;
    (void)param;
    check_reset();
    if (word == INTS)
        return read_ints() & regs[INTE];
    return word < N_REGS ? regs[word] : 0;
}

static void
regs_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
           void *param)
{
    uint32_t word = (uint32_t)(offset & 0xfff) / 4;

    (void)uc;
    (void)size;
    (void)param;
    check_reset();
    if (word >= N_REGS)
        return;
    if (word == SIE_STATUS || word == BUFF_STATUS)
        regs[word] &= ~(uint32_t)value;
    else
        regs[word] = rp_combine(regs[word], (uint32_t)value,
                                (uint32_t)offset >> 12 & 3);
    if (word == SIE_CTRL)
        chip_wake_at(chip.cycle);
    update_irq();
}

/* All but the flag that gives a buffer away must have been written before. */
static void
on_buffer_write(uc_engine *uc, uc_mem_type type, uint64_t addr, int size,
                int64_t value, void *param)
{
    uint32_t old = *(uint32_t *)&memory[addr & 0xffc];

    (void)uc;
    (void)type;
    (void)param;
    if (size != 4 || (value & AVAILABLE && !(old & AVAILABLE)
                      && ((uint32_t)value & ~(uint32_t)AVAILABLE) != old))
        chip_fault("a buffer is given away before it is described");
}

void
rp_usb_map(uc_engine *uc)
{
    uc_hook hook;

    if (uc_mem_map_ptr(uc, MEMORY_BASE, sizeof(memory),
                       UC_PROT_READ | UC_PROT_WRITE, memory)
        || uc_hook_add(uc, &hook, UC_HOOK_MEM_WRITE, (void *)on_buffer_write,
                       NULL, MEMORY_BASE + 0x80, MEMORY_BASE + 0xff)
        || uc_mmio_map(uc, REGS_BASE, 0x4000, regs_read, NULL, regs_write,
                       NULL))
        chip_fault("no USB");
}

void
rp_usb_reset(void)
{
    memset(memory, 0, sizeof(memory));
    memset(regs, 0, sizeof(regs));
    regs[MAIN_CTRL] = rp.is_2350 ? 4 : 0;      /* the transceiver is cut off */
    usbhost_start(&controller);
}

bool
rp_usb_is_on(void)
{
    return regs[MAIN_CTRL] & 1;
}
