/* SPDX-License-Identifier: GPL-3.0-or-later
 * The OTG core as a full-speed USB device, of F2, F4, F7 and H7 (RM0090, 34;
 * RM0433, 60).
 *
 * What comes from the host lies in one fifo: it is taken out in order into a
 * buffer for each endpoint, which is enabled for one packet at a time, so that
 * there is always room.
 */
#include <string.h>

#include "board/irq.h"
#include "board/reset.h"
#include "board/timer.h"
#include "board/usb.h"
#include "chip.h"
#include "core/sched.h"
#include "stm32/otg.h"
#include "usb_clock.h"
#include "usb_pins.h"

#if CONFIG_MACH_STM32H723 || CONFIG_STM32_USB_PB14_PB15
#define OTG_BASE OTG_HS_BASE
#define OTG_GATE OTG_HS_GATE
#define OTG_IRQ OTG_HS_IRQ
#else
#define OTG_BASE OTG_FS_BASE
#define OTG_GATE OTG_FS_GATE
#define OTG_IRQ OTG_FS_IRQ
#endif
#define OTG ((struct otg_regs *)OTG_BASE)
#define DEV ((struct otg_device_regs *)(OTG_BASE + OTG_DEVICE_OFFSET))
#define FIFO(EP) (*(volatile uint32_t *)(OTG_BASE + OTG_FIFO_OFFSET(EP)))

/* Words of 320: packets to come (RM0090, 34.11: setups, status, one packet
 * twice), then one packet for each endpoint */
enum { RX_WORDS = 128, TX_WORDS = 32 };

/* A packet from the host; len -1: none. */
struct packet {
    int8_t len;
    uint8_t data[USB_BULK_SIZE];
};
static struct packet ep0_packet = { .len = -1 }, bulk_packet = { .len = -1 };
static struct usb_setup last_setup;
static bool has_setup;

static void read_fifo(uint8_t *data, uint32_t max, uint32_t len)
{
    uint32_t i, word = 0;

    for (i = 0; i < len; i++) {
        if (i % 4 == 0)
            word = FIFO(0);
        if (i < max)
            data[i] = (uint8_t)word;
        word >>= 8;
    }
}

static void write_fifo(uint32_t ep, const uint8_t *data, uint32_t len)
{
    uint32_t word, n;

    for (; len; len -= n, data += n) {
        word = 0;
        n = len < 4 ? len : 4;
        memcpy(&word, data, n);
        FIFO(ep) = word;
    }
}

/* The endpoint takes one packet; endpoint 0 also setup packets. */
static void enable_out(uint32_t ep)
{
    DEV->OUT[ep].TSIZ = (ep ? 0 : OTG_TSIZ_SETUPS) | OTG_TSIZ_PACKET
        | USB_BULK_SIZE;
    DEV->OUT[ep].CTL |= OTG_EPCTL_ENABLE | OTG_EPCTL_CNAK;
}

static void take_packet(uint32_t status)
{
    struct packet *packet = OTG_RXSTS_EP(status) ? &bulk_packet : &ep0_packet;
    uint32_t len = OTG_RXSTS_COUNT(status);

    read_fifo(packet->data, sizeof(packet->data), len);
    packet->len = (int8_t)len;
}

/* What came before a setup packet is void. */
static void take_setup(uint32_t status)
{
    read_fifo((uint8_t *)&last_setup, sizeof(last_setup),
              OTG_RXSTS_COUNT(status));
    ep0_packet.len = -1;
    has_setup = true;
}

static void drain_fifo(void)
{
    while (OTG->GINTSTS & OTG_GINT_RXFLVL) {
        uint32_t status = OTG->GRXSTSP;

        if (OTG_RXSTS_KIND(status) == OTG_RX_OUT)
            take_packet(status);
        else if (OTG_RXSTS_KIND(status) == OTG_RX_SETUP)
            take_setup(status);
        else if (OTG_RXSTS_KIND(status) == OTG_RX_SETUP_DONE)
            enable_out(0);
    }
}

static void flush_tx(uint32_t fifo)
{
    OTG->GRSTCTL = fifo | OTG_GRSTCTL_TXFFLSH;
    while (OTG->GRSTCTL & OTG_GRSTCTL_TXFFLSH)
        ;
}

/*
 * The bus
 */

static void note_bus_reset(void)
{
    uint32_t ep;

    drain_fifo();
    for (ep = 1; ep < USB_EP_COUNT; ep++) {
        if (DEV->IN[ep].CTL & OTG_EPCTL_ENABLE)
            DEV->IN[ep].CTL = OTG_EPCTL_DISABLE | OTG_EPCTL_SNAK;
        if (DEV->OUT[ep].CTL & OTG_EPCTL_ENABLE)
            DEV->OUT[ep].CTL = OTG_EPCTL_DISABLE | OTG_EPCTL_SNAK;
    }
    flush_tx(OTG_GRSTCTL_ALL_TX);
    DEV->DCFG &= ~OTG_DCFG_ADDRESS_MASK;
    has_setup = false;
    ep0_packet.len = bulk_packet.len = -1;
    DEV->IN[0].CTL = OTG_EPCTL_EP0_64;
    enable_out(0);
    usb_note_reset();
}

void otg_irq(void)
{
    if (OTG->GINTSTS & OTG_GINT_USBRST) {
        OTG->GINTSTS = OTG_GINT_USBRST;
        note_bus_reset();
        return;
    }
    OTG->GINTMSK = OTG_GINT_USBRST;
    usb_note();
}

/* Only what was waited for may interrupt: a flag that nobody asks about would
 * do so for ever. */
void usb_wait_for(uint8_t events)
{
    DEV->DAINTMSK = (events & USB_WAIT_EP0 ? 1u : 0)
        | (events & USB_WAIT_IN ? 1u << USB_EP_IN : 0);
    OTG->GINTMSK = OTG_GINT_USBRST | OTG_GINT_RXFLVL | OTG_GINT_IEPINT;
}

/*
 * Control transfers
 */

/* An answer that the host did not fetch must not stay in the fifo. */
static void cancel_ep0(void)
{
    if (!(DEV->IN[0].CTL & OTG_EPCTL_ENABLE))
        return;
    DEV->IN[0].CTL |= OTG_EPCTL_DISABLE | OTG_EPCTL_SNAK;
    while (!(DEV->IN[0].INT & OTG_EPINT_EPDISD))
        ;
    DEV->IN[0].INT = OTG_EPINT_EPDISD;
    flush_tx(OTG_GRSTCTL_TXFNUM(0));
}

bool usb_take_setup(struct usb_setup *setup)
{
    irq_flag_t flag = irq_save();
    bool found;

    drain_fifo();
    found = has_setup;
    has_setup = false;
    *setup = found ? last_setup : *setup;
    if (found)
        cancel_ep0();
    irq_restore(flag);
    return found;
}

int8_t usb_ep0_receive(uint8_t *data, uint8_t max)
{
    int8_t len;
    irq_flag_t flag = irq_save();

    drain_fifo();
    len = ep0_packet.len;
    if (len > max)
        len = (int8_t)max;
    if (len > 0)
        memcpy(data, ep0_packet.data, (size_t)len);
    ep0_packet.len = -1;
    irq_restore(flag);
    return len;
}

static bool send(uint32_t ep, const uint8_t *data, uint32_t len)
{
    irq_flag_t flag = irq_save();
    bool is_free = !(DEV->IN[ep].CTL & OTG_EPCTL_ENABLE);

    if (is_free) {
        DEV->IN[ep].INT = OTG_EPINT_XFRC;
        DEV->IN[ep].TSIZ = OTG_TSIZ_PACKET | len;
        DEV->IN[ep].CTL |= OTG_EPCTL_ENABLE | OTG_EPCTL_CNAK;
        write_fifo(ep, data, len);
    }
    irq_restore(flag);
    return is_free;
}

bool usb_ep0_send(const uint8_t *data, uint8_t len)
{
    return send(0, data, len);
}

void usb_ep0_stall(void)
{
    DEV->IN[0].CTL |= OTG_EPCTL_STALL;
    DEV->OUT[0].CTL |= OTG_EPCTL_STALL;
}

bool usb_set_address(uint8_t address)
{
    if (DEV->IN[0].CTL & OTG_EPCTL_ENABLE)
        return false;
    DEV->DCFG = (DEV->DCFG & ~OTG_DCFG_ADDRESS_MASK)
        | OTG_DCFG_ADDRESS(address);
    return true;
}

void usb_set_configured(void)
{
#if !CONFIG_USBCANBUS
    DEV->IN[USB_EP_NOTIFY].CTL = USB_NOTIFY_SIZE | OTG_EPCTL_ACTIVE
        | OTG_EPCTL_INTERRUPT | OTG_EPCTL_FIFO(USB_EP_NOTIFY)
        | OTG_EPCTL_DATA0;
#endif
    DEV->IN[USB_EP_IN].CTL = USB_BULK_SIZE | OTG_EPCTL_ACTIVE | OTG_EPCTL_BULK
        | OTG_EPCTL_FIFO(USB_EP_IN) | OTG_EPCTL_DATA0;
    DEV->OUT[USB_EP_OUT].CTL = USB_BULK_SIZE | OTG_EPCTL_ACTIVE
        | OTG_EPCTL_BULK | OTG_EPCTL_DATA0;
    bulk_packet.len = -1;
    enable_out(USB_EP_OUT);
}

/*
 * Data
 */

int8_t usb_receive(uint8_t *data)
{
    irq_flag_t flag = irq_save();
    int8_t len;

    drain_fifo();
    len = bulk_packet.len;
    if (len >= 0) {
        memcpy(data, bulk_packet.data, (size_t)len);
        bulk_packet.len = -1;
        enable_out(USB_EP_OUT);
    }
    irq_restore(flag);
    return len;
}

bool usb_send(const uint8_t *data, uint8_t len)
{
    return send(USB_EP_IN, data, len);
}

/*
 * Start and end
 */

/* Long enough for the host to notice: 10 ms. */
static void wait_detached(void)
{
    uint32_t start = timer_read_clock();

    while (timer_read_clock() - start < CONFIG_CLOCK_FREQ / 100)
        ;
}

void usb_enter_bootloader(void)
{
    irq_disable();
    DEV->DCTL |= OTG_DCTL_SDIS;
    wait_detached();
    reset_to_bootloader();
}

static void reset_core(void)
{
    OTG->GUSBCFG |= OTG_GUSBCFG_PHYSEL;
    while (!(OTG->GRSTCTL & OTG_GRSTCTL_AHBIDL))
        ;
    OTG->GRSTCTL = OTG_GRSTCTL_CSRST;
    while (OTG->GRSTCTL & OTG_GRSTCTL_CSRST)
        ;
    while (!(OTG->GRSTCTL & OTG_GRSTCTL_AHBIDL))
        ;
    *(volatile uint32_t *)(OTG_BASE + OTG_PCGCCTL_OFFSET) = 0;
}

/* The pin that senses the host's voltage is not needed: it is taken to be
 * there. */
static void power_transceiver(void)
{
#if CONFIG_MACH_STM32F2 || CONFIG_MACH_STM32F401 || CONFIG_MACH_STM32F4x5
    OTG->GCCFG = OTG_GCCFG_PWRDWN | OTG_GCCFG_NOVBUSSENS;
#else
    OTG->GCCFG = OTG_GCCFG_PWRDWN;
    OTG->GOTGCTL |= OTG_GOTGCTL_BVALOEN | OTG_GOTGCTL_BVALOVAL;
#endif
}

static void divide_fifo(void)
{
    uint32_t ep;

    OTG->GRXFSIZ = RX_WORDS;
    OTG->DIEPTXF0 = OTG_FIFO(RX_WORDS, TX_WORDS);
    for (ep = 1; ep < USB_EP_COUNT; ep++)
        OTG->DIEPTXF[ep - 1] = OTG_FIFO(RX_WORDS + TX_WORDS * ep, TX_WORDS);
    flush_tx(OTG_GRSTCTL_ALL_TX);
    OTG->GRSTCTL = OTG_GRSTCTL_RXFFLSH;
    while (OTG->GRSTCTL & OTG_GRSTCTL_RXFFLSH)
        ;
}

void otg_init(void)
{
    usb_clock_start();
    chip_enable(OTG_GATE);
    reset_core();
    DEV->DCTL |= OTG_DCTL_SDIS;
    /* turnaround: 6 for a bus clock above 32 MHz (RM0090, table 201) */
    OTG->GUSBCFG = OTG_GUSBCFG_PHYSEL | OTG_GUSBCFG_FDMOD
        | OTG_GUSBCFG_TRDT(6);
    power_transceiver();
    DEV->DCFG = OTG_DCFG_FULL_SPEED;
    divide_fifo();
    gpio_alternate(USB_PIN_DM, USB_PIN_FUNCTION, 0);
    gpio_alternate(USB_PIN_DP, USB_PIN_FUNCTION, 0);
    DEV->DIEPMSK = OTG_EPINT_XFRC;
    OTG->GINTSTS = UINT32_MAX;
    OTG->GINTMSK = OTG_GINT_USBRST;
    OTG->GAHBCFG = OTG_GAHBCFG_GINT;
    armcm_connect(OTG_IRQ, otg_irq);
    /* forced to be a device after 25 ms */
    wait_detached();
    wait_detached();
    wait_detached();
    DEV->DCTL &= ~OTG_DCTL_SDIS;
}
DECL_INIT(otg_init);
