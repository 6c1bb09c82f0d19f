/* SPDX-License-Identifier: GPL-3.0-or-later
 * The full-speed USB device controller of F0, F1, G0, G4 and L4 (RM0008, 23).
 *
 * What an endpoint's STAT says is its state: a packet from the host waits, or
 * one can be sent, while it is NAK.  The flags CTR only interrupt; that of
 * endpoint 0 stays until a packet of the host is taken, so that none comes
 * before.
 */
#include "board/gpio.h"
#include "board/irq.h"
#include "board/reset.h"
#include "board/timer.h"
#include "board/usb.h"
#include "chip.h"
#include "core/sched.h"
#include "stm32/usbfs.h"
#include "usb_clock.h"
#include "usb_memory.h"
#include "usb_pins.h"

#define USB ((struct usbfs_regs *)USB_BASE)

/* Kept by a write that clears no flag and inverts nothing */
#define EPR_KEPT (USB_EPR_TYPE | USB_EPR_KIND | USB_EPR_EA)
#define EPR_FLAGS (USB_EPR_CTR_RX | USB_EPR_CTR_TX)

/* The address takes effect once its transfer has ended. */
static bool expects_data;

static void write_epr(uint32_t ep, uint32_t clear, uint32_t invert)
{
    uint32_t kept = USB->EPR[ep] & EPR_KEPT;

    USB->EPR[ep] = kept | (EPR_FLAGS & ~clear) | invert;
}

static uint32_t stat_tx(uint32_t ep)
{
    return (USB->EPR[ep] & USB_EPR_STAT_TX) >> 4;
}

static uint32_t stat_rx(uint32_t ep)
{
    return (USB->EPR[ep] & USB_EPR_STAT_RX) >> 12;
}

static void set_stat_tx(uint32_t ep, uint32_t stat)
{
    write_epr(ep, 0, (USB->EPR[ep] & USB_EPR_STAT_TX) ^ USB_STAT_TX(stat));
}

static void set_stat_rx(uint32_t ep, uint32_t stat)
{
    write_epr(ep, 0, (USB->EPR[ep] & USB_EPR_STAT_RX) ^ USB_STAT_RX(stat));
}

/* Data begins with the toggle 0 again. */
static void set_up(uint32_t ep, uint32_t type, uint32_t tx, uint32_t rx)
{
    irq_flag_t flag = irq_save();
    uint32_t now = USB->EPR[ep];

    usb_memory_place(ep);
    USB->EPR[ep] = type | ep
        | (now & (USB_EPR_DTOG_TX | USB_EPR_DTOG_RX))
        | ((now & USB_EPR_STAT_TX) ^ USB_STAT_TX(tx))
        | ((now & USB_EPR_STAT_RX) ^ USB_STAT_RX(rx));
    irq_restore(flag);
}

static void note_bus_reset(void)
{
    uint32_t ep;

    for (ep = 1; ep < USB_EP_COUNT; ep++)
        set_up(ep, 0, USB_STAT_DISABLED, USB_STAT_DISABLED);
    set_up(0, USB_EPR_CONTROL, USB_STAT_NAK, USB_STAT_VALID);
    USB->DADDR = USB_DADDR_EF;
    usb_note_reset();
}

void usbfs_irq(void)
{
    uint32_t ep;

    if (USB->ISTR & USB_ISTR_RESET) {
        USB->ISTR = ~USB_ISTR_RESET;
        note_bus_reset();
        return;
    }
    write_epr(0, USB_EPR_CTR_TX, 0);
    for (ep = 1; ep < USB_EP_COUNT; ep++)
        write_epr(ep, EPR_FLAGS, 0);
    USB->CNTR = USB_CNTR_RESETM;
    usb_note();
}

void usb_wait_for(uint8_t events)
{
    (void)events;
    USB->CNTR = USB_CNTR_RESETM | USB_CNTR_CTRM;
}

/*
 * Control transfers
 */

static void drop_packet(void)
{
    irq_flag_t flag = irq_save();

    write_epr(0, USB_EPR_CTR_RX, 0);
    irq_restore(flag);
}

static void arm_ep0(uint32_t stat)
{
    irq_flag_t flag = irq_save();

    set_stat_rx(0, stat);
    irq_restore(flag);
}

/* A control transfer has one packet from the host behind its setup packet: of
 * data, or the empty one at the end. */
bool usb_take_setup(struct usb_setup *setup)
{
    uint32_t epr = USB->EPR[0];

    if (!(epr & USB_EPR_CTR_RX))
        return false;
    if (!(epr & USB_EPR_SETUP)) {
        if (!expects_data)
            drop_packet();
        return false;
    }
    usb_memory_read(0, (uint8_t *)setup, sizeof(*setup));
    expects_data = !(setup->type & 0x80) && setup->length;
    drop_packet();
    arm_ep0(USB_STAT_VALID);
    return true;
}

int8_t usb_ep0_receive(uint8_t *data, uint8_t max)
{
    uint32_t epr = USB->EPR[0], len;

    if ((epr & (USB_EPR_CTR_RX | USB_EPR_SETUP)) != USB_EPR_CTR_RX)
        return -1;
    len = usb_memory_count(0);
    if (len > max)
        len = max;
    usb_memory_read(0, data, len);
    drop_packet();
    return (int8_t)len;
}

static bool send(uint32_t ep, const uint8_t *data, uint32_t len)
{
    irq_flag_t flag;

    if (stat_tx(ep) != USB_STAT_NAK)
        return false;
    usb_memory_write(ep, data, len);
    flag = irq_save();
    set_stat_tx(ep, USB_STAT_VALID);
    irq_restore(flag);
    return true;
}

bool usb_ep0_send(const uint8_t *data, uint8_t len)
{
    return send(0, data, len);
}

void usb_ep0_stall(void)
{
    irq_flag_t flag = irq_save();

    set_stat_tx(0, USB_STAT_STALL);
    set_stat_rx(0, USB_STAT_STALL);
    irq_restore(flag);
}

bool usb_set_address(uint8_t address)
{
    if (stat_tx(0) != USB_STAT_NAK)
        return false;
    USB->DADDR = USB_DADDR_EF | address;
    return true;
}

void usb_set_configured(void)
{
#if !CONFIG_USBCANBUS
    set_up(USB_EP_NOTIFY, USB_EPR_INTERRUPT, USB_STAT_NAK, USB_STAT_DISABLED);
#endif
    set_up(USB_EP_OUT, USB_EPR_BULK, USB_STAT_DISABLED, USB_STAT_VALID);
    set_up(USB_EP_IN, USB_EPR_BULK, USB_STAT_NAK, USB_STAT_DISABLED);
}

/*
 * Data
 */

int8_t usb_receive(uint8_t *data)
{
    irq_flag_t flag;
    uint32_t len;

    if (stat_rx(USB_EP_OUT) != USB_STAT_NAK)
        return -1;
    len = usb_memory_count(USB_EP_OUT);
    usb_memory_read(USB_EP_OUT, data, len);
    flag = irq_save();
    set_stat_rx(USB_EP_OUT, USB_STAT_VALID);
    irq_restore(flag);
    return (int8_t)len;
}

bool usb_send(const uint8_t *data, uint8_t len)
{
    return send(USB_EP_IN, data, len);
}

/*
 * Start and end
 */

/* The host sees the device by its pull-up; that of an F103 is on the board: it
 * is held down. */
static void detach(void)
{
#if CONFIG_MACH_STM32F1
    gpio_setup_output(USB_PIN_DP, 0);
#else
    USB->BCDR = 0;
#endif
}

static void attach(void)
{
#if CONFIG_MACH_STM32F1
    gpio_setup_input(USB_PIN_DP, 0);
#else
    USB->BCDR = USB_BCDR_DPPU;
#endif
}

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
    USB->CNTR = USB_CNTR_FRES | USB_CNTR_PDWN;
    detach();
    wait_detached();
    reset_to_bootloader();
}

void usbfs_init(void)
{
    usb_clock_start();
    chip_enable(USB_GATE);
    detach();
    wait_detached();
    /* the transceiver takes its pins, and settles within 1 us */
    USB->CNTR = USB_CNTR_FRES;
    USB->BTABLE = 0;
    wait_detached();
    USB->CNTR = 0;
    USB->ISTR = 0;
    USB->CNTR = USB_CNTR_RESETM | USB_CNTR_CTRM;
    armcm_connect(USB_IRQ, usbfs_irq);
    attach();
}
DECL_INIT(usbfs_init);
