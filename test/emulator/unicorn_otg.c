/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The OTG core of an STM32 as a full-speed device (RM0090, 34; RM0433, 60):
 * its receive fifo, endpoints, and what they answer.
 */
#include <string.h>

#include "unicorn_stm32.h"
#include "unicorn_usbhost.h"

enum { GAHBCFG = 0x008, GUSBCFG = 0x00c, GRSTCTL = 0x010, GINTSTS = 0x014,
       GINTMSK = 0x018, GRXSTSR = 0x01c, GRXSTSP = 0x020, GRXFSIZ = 0x024,
       DIEPTXF0 = 0x028, GCCFG = 0x038, DIEPTXF1 = 0x104, DCFG = 0x800,
       DCTL = 0x804, DIEPMSK = 0x810, DAINTMSK = 0x81c, IN_EP = 0x900,
       OUT_EP = 0xb00, FIFOS = 0x1000 };
enum { EP_CTL = 0, EP_INT = 8, EP_TSIZ = 16 };
enum { RXFLVL = 1 << 4, USBRST = 1 << 12, IEPINT = 1 << 18 };
#define ENABLE (1u << 31)
#define DISABLE (1u << 30)
#define SNAK (1u << 27)
#define CNAK (1u << 26)
#define NAKSTS (1u << 17)
#define STALL (1u << 21)
#define DATA0 (1u << 28)
#define DPID (1u << 16)         /* in an endpoint's control: DATA1 is next */
enum { N_EPS = 4, FIFO_WORDS = 320, REG_BYTES = 0xf00 };

static uint32_t regs[REG_BYTES / 4];
static struct device *dev;
/* Receive fifo: entries of a status and the words behind it */
static uint32_t rx[FIFO_WORDS], n_rx, data_left;
static uint8_t tx[N_EPS][128];
static uint32_t n_tx[N_EPS];
static uint32_t pid0[2];        /* of endpoint 0: next to the host, from it */

static uint32_t *
reg(uint32_t offset)
{
    return &regs[offset / 4];
}

static uint32_t *
in_ep(uint32_t ep, uint32_t offset)
{
    return reg(IN_EP + 0x20 * ep + offset);
}

static uint32_t *
out_ep(uint32_t ep, uint32_t offset)
{
    return reg(OUT_EP + 0x20 * ep + offset);
}

static uint32_t
read_status(void)
{
    uint32_t status = *reg(GINTSTS) & USBRST, ep;

    if (n_rx && !data_left)
        status |= RXFLVL;
    for (ep = 0; ep < N_EPS; ep++)
        if (*in_ep(ep, EP_INT) & *reg(DIEPMSK) && *reg(DAINTMSK) & (1u << ep))
            status |= IEPINT;
    return status;
}

static void
update_irq(void)
{
    core_set_level(16u + dev->info->irq, *reg(GAHBCFG) & 1
                   && read_status() & *reg(GINTMSK));
}

/*
 * Fifos
 */

static uint32_t
pop_word(void)
{
    uint32_t word = rx[0];

    if (!n_rx) {
        chip_fault("the receive fifo of USB is read while it is empty");
        return 0;
    }
    memmove(rx, rx + 1, --n_rx * sizeof(rx[0]));
    return word;
}

static uint32_t
pop_status(void)
{
    uint32_t status;

    if (data_left)
        chip_fault("%u words are left in the receive fifo", data_left);
    status = pop_word();
    data_left = ((status >> 4 & 0x7ff) + 3) / 4;
    return status;
}

static void
push(uint32_t ep, uint32_t kind, const uint8_t *data, uint32_t len)
{
    uint32_t words = (len + 3) / 4;

    if (n_rx + words + 1 > (*reg(GRXFSIZ) & 0xffff)) {
        chip_fault("the receive fifo overflows");
        return;
    }
    rx[n_rx++] = ep | len << 4 | kind << 17;
    if (words) {
        rx[n_rx + words - 1] = 0;
        memcpy(&rx[n_rx], data, len);
    }
    n_rx += words;
    update_irq();
}

static void
push_tx(uint32_t ep, uint32_t value)
{
    uint32_t len = *in_ep(ep, EP_TSIZ) & 0x7f;
    uint32_t depth = *reg(ep ? DIEPTXF1 + 4 * (ep - 1) : DIEPTXF0) >> 16;

    if (!(*in_ep(ep, EP_CTL) & ENABLE) || n_tx[ep] + 4 > 4 * depth
        || n_tx[ep] >= len || n_tx[ep] + 4 > sizeof(tx[0])) {
        chip_fault("a word too many in fifo %u", ep);
        return;
    }
    memcpy(&tx[ep][n_tx[ep]], &value, 4);
    n_tx[ep] += 4;
}

static void
check_division(void)
{
    uint32_t ep, start = *reg(GRXFSIZ) & 0xffff;

    for (ep = 0; ep < N_EPS; ep++) {
        uint32_t size = *reg(ep ? DIEPTXF1 + 4 * (ep - 1) : DIEPTXF0);

        if (!size)
            continue;
        if ((size & 0xffff) < start || (size >> 16) < 16
            || (size & 0xffff) + (size >> 16) > FIFO_WORDS)
            chip_fault("fifo %u from %u on, %u words", ep, size & 0xffff,
                       size >> 16);
        start = (size & 0xffff) + (size >> 16);
    }
}

static void
write_reset(uint32_t value)
{
    uint32_t ep, number = value >> 6 & 31;

    if (value & 1) {
        memset(regs, 0, sizeof(regs));
        *reg(DCTL) = 2;
    }
    if (value & (1u << 4))
        n_rx = data_left = 0;
    if (value & (1u << 5))
        for (ep = 0; ep < N_EPS; ep++)
            if (number == 16 || number == ep)
                n_tx[ep] = 0;
}

/*
 * Registers
 */

static void
write_control(uint32_t *ctl, uint32_t *flags, uint32_t value)
{
    uint32_t kept = *ctl & (NAKSTS | DPID);

    if (value & SNAK)
        kept |= NAKSTS;
    if (value & CNAK)
        kept &= ~NAKSTS;
    if (value & DATA0)
        kept &= ~DPID;
    if (value & DISABLE && *ctl & ENABLE) {
        *flags |= 2;
        value &= ~ENABLE;
    }
    *ctl = (value & ~(SNAK | CNAK | DATA0 | DISABLE | NAKSTS | DPID)) | kept;
}

uint32_t
otg_read(uint32_t offset)
{
    uint32_t value;

    if (offset >= FIFOS) {
        if (!data_left) {
            chip_fault("more is read than a packet has");
            return 0;
        }
        data_left--;
        value = pop_word();
        update_irq();
        return value;
    }
    if (offset == GINTSTS)
        return read_status();
    if (offset == GRSTCTL)
        return 1u << 31;
    if (offset == GRXSTSP) {
        value = pop_status();
        update_irq();
        return value;
    }
    return offset < REG_BYTES ? *reg(offset) : 0;
}

void
otg_write(struct device *d, uint32_t offset, uint32_t value)
{
    uint32_t ep = (offset - IN_EP) / 0x20, field = offset & 0x1f;

    dev = d;                    /* of two cores the one that is used */
    if (offset >= FIFOS) {
        push_tx((offset - FIFOS) / 0x1000, value);
        return;
    }
    if (offset >= REG_BYTES)
        return;
    if (offset == GINTSTS)
        *reg(GINTSTS) &= ~value;
    else if (offset == GRSTCTL)
        write_reset(value);
    else if (offset >= OUT_EP && field == EP_CTL)
        write_control(out_ep((offset - OUT_EP) / 0x20, EP_CTL),
                      out_ep((offset - OUT_EP) / 0x20, EP_INT), value);
    else if (offset >= IN_EP && offset < OUT_EP && field == EP_CTL)
        write_control(in_ep(ep, EP_CTL), in_ep(ep, EP_INT), value);
    else if (offset >= IN_EP && field == EP_INT)
        *reg(offset) &= ~value;
    else
        *reg(offset) = value;
    if (offset == DCTL)
        chip_wake_at(chip.cycle);
    update_irq();
}

/*
 * What the host sees
 */

static bool
is_attached(void)
{
    bool is_old = !strcmp(chip.model->name, "stm32f401")
        || !strncmp(chip.model->name, "stm32f40", 8)
        || !strcmp(chip.model->name, "stm32f207")
        || !strcmp(chip.model->name, "stm32f429");
    bool senses = is_old ? *reg(GCCFG) & (1u << 21)
        : (*reg(0) & 0xc0) == 0xc0 && !(*reg(GCCFG) & (1u << 21));
    bool on = rcc_has_clock(dev) && !(*reg(DCTL) & 2)
        && *reg(GCCFG) & (1u << 16) && senses && (*reg(DCFG) & 3) == 3
        && *reg(GUSBCFG) & (1u << 30);

    if (!on)
        return false;
    stm32_check_usb_clock();
    check_division();
    stm32_check_usb_pins(dev);
    return true;
}

static void
reset_bus(void)
{
    uint32_t ep;

    for (ep = 1; ep < N_EPS; ep++) {
        *in_ep(ep, EP_CTL) &= ~(1u << 15);
        *out_ep(ep, EP_CTL) &= ~(1u << 15);
    }
    *reg(DCFG) &= ~(0x7fu << 4);
    *reg(GINTSTS) |= USBRST;
    update_irq();
}

/* The fifo has space for a setup packet; what endpoint 0 was to do stops. */
static enum usb_answer
take_setup(const struct usb_packet *packet)
{
    push(0, 6, packet->data, 8);
    push(0, 4, NULL, 0);
    *in_ep(0, EP_CTL) = (*in_ep(0, EP_CTL) | NAKSTS) & ~STALL;
    *out_ep(0, EP_CTL) = (*out_ep(0, EP_CTL) | NAKSTS) & ~(STALL | ENABLE);
    pid0[0] = pid0[1] = 1;
    return ANSWER_ACK;
}

static enum usb_answer
take(uint32_t ep, const struct usb_packet *packet)
{
    uint32_t *ctl = out_ep(ep, EP_CTL), *size = out_ep(ep, EP_TSIZ);
    uint32_t pid = ep ? (*ctl & DPID ? 1 : 0) : pid0[1];

    if (*ctl & STALL)
        return ANSWER_STALL;
    if (!(*ctl & ENABLE) || *ctl & NAKSTS || !(*size >> 19 & 0x3ff))
        return ANSWER_NAK;
    if (packet->pid != pid)
        return ANSWER_ACK;      /* it was there before */
    if (packet->len > (*size & 0x7f))
        chip_fault("%u bytes for endpoint %u", packet->len, ep);
    push(ep, 2, packet->data, packet->len);
    push(ep, 3, NULL, 0);
    *ctl = (*ctl & ~ENABLE) ^ DPID;
    pid0[1] ^= !ep;
    *size = (*size & 0x7f) - packet->len;
    return ANSWER_ACK;
}

static enum usb_answer
give(uint32_t ep, struct usb_packet *packet)
{
    uint32_t *ctl = in_ep(ep, EP_CTL), size = *in_ep(ep, EP_TSIZ);

    if (*ctl & STALL)
        return ANSWER_STALL;
    if (!(*ctl & ENABLE) || *ctl & NAKSTS)
        return ANSWER_NAK;
    packet->len = size & 0x7f;
    if (n_tx[ep] != (packet->len + 3) / 4 * 4)
        return ANSWER_NAK;      /* not yet in the fifo */
    packet->pid = ep ? (*ctl & DPID ? 1 : 0) : pid0[0];
    memcpy(packet->data, tx[ep], packet->len);
    n_tx[ep] = 0;
    *ctl = (*ctl & ~ENABLE) ^ DPID;
    pid0[0] ^= !ep;
    *in_ep(ep, EP_INT) |= 1;
    *in_ep(ep, EP_TSIZ) = 0;
    update_irq();
    return ANSWER_ACK;
}

static enum usb_answer
transact(enum usb_token token, uint32_t address, uint32_t endpoint,
         struct usb_packet *packet)
{
    uint32_t *ctl = token == TOKEN_IN ? in_ep(endpoint & 3, EP_CTL)
        : out_ep(endpoint & 3, EP_CTL);

    if (endpoint >= N_EPS || !is_attached()
        || (*reg(DCFG) >> 4 & 0x7f) != address
        || (endpoint && !(*ctl & (1u << 15))))
        return ANSWER_NOTHING;
    if (token == TOKEN_SETUP)
        return take_setup(packet);
    return token == TOKEN_IN ? give(endpoint, packet) : take(endpoint, packet);
}

void
otg_reset(struct device *d)
{
    static const struct usb_controller controller = {
        .is_attached = is_attached, .reset_bus = reset_bus,
        .transact = transact,
    };

    dev = d;
    memset(regs, 0, sizeof(regs));
    memset(n_tx, 0, sizeof(n_tx));
    n_rx = data_left = 0;
    *reg(DCTL) = 2;
    usbhost_start(&controller);
}
