/* SPDX-License-Identifier: GPL-3.0-or-later
 * The USB device controller (UM10360, chapter 11).
 *
 * Endpoints and buffers are reached by commands to its serial interface engine,
 * which only tasks give.  The interrupt masks itself and wakes the task, which
 * looks at what is full or empty.
 */
#include "board/irq.h"
#include "board/reset.h"
#include "board/usb.h"
#include "chip.h"
#include "core/sched.h"

DECL_CONSTANT_STR("RESERVE_PINS_USB", "P0.30,P0.29,P2.9");

#define REGS USB_REGS
#define INTERRUPTS (USB_INT_EP_SLOW | USB_INT_DEV_STAT)

/* Endpoints by direction.  The first is made for interrupts, with one buffer:
 * as the bulk endpoint of a CAN adapter it is slower, which a host cannot
 * tell. */
enum { EP0_OUT = 0, EP0_IN = 1, BULK_OUT = 2 * USB_EP_OUT,
       BULK_IN = 2 * USB_EP_IN + 1 };

/* What lies in the buffer of endpoint 0, and whether its other buffer must
 * become empty before the transfer can go on. */
static bool has_setup, has_ep0_data, waits_for_ep0;

/*
 * The engine
 */

static void give(uint32_t word, uint32_t until)
{
    REGS->DevIntClr = until;
    REGS->CmdCode = word;
    while (!(REGS->DevIntSt & until))
        ;
    REGS->DevIntClr = until;
}

static void command(uint32_t code)
{
    give(SIE_COMMAND(code), USB_INT_CCEMPTY);
}

static void command_write(uint32_t code, uint8_t value)
{
    command(code);
    give(SIE_DATA(value), USB_INT_CCEMPTY);
}

static uint8_t command_read(uint32_t code)
{
    command(code);
    give(SIE_READ(code), USB_INT_CDFULL);
    return (uint8_t)REGS->CmdData;
}

/* Its interrupt is no longer pending; returns how it was selected then. */
static uint8_t clear_interrupt(uint32_t endpoint)
{
    REGS->DevIntClr = USB_INT_CDFULL;
    REGS->EpIntClr = 1u << endpoint;
    while (!(REGS->DevIntSt & USB_INT_CDFULL))
        ;
    REGS->DevIntClr = USB_INT_CDFULL;
    return (uint8_t)REGS->CmdData;
}

static bool is_full(uint32_t endpoint)
{
    return command_read(SIE_SELECT(endpoint)) & SIE_SELECT_FULL;
}

/* The endpoint exists from now on, with empty buffers. */
static void realize(uint32_t endpoint, uint32_t size)
{
    REGS->DevIntClr = USB_INT_EP_RLZED;
    REGS->ReEp |= 1u << endpoint;
    REGS->EpInd = endpoint;
    REGS->MaxPSize = size;
    while (!(REGS->DevIntSt & USB_INT_EP_RLZED))
        ;
    command_write(SIE_ENDPOINT_STATUS(endpoint), 0);
}

/*
 * Packets
 */

static void write_packet(uint32_t endpoint, const uint8_t *data, uint8_t len)
{
    uint32_t i, word = 0;

    REGS->Ctrl = USB_CTRL_WRITE(endpoint / 2);
    REGS->TxPLen = len;
    for (i = 0; i < len; i++) {
        word = i % 4 ? word | (uint32_t)data[i] << 8 * (i % 4) : data[i];
        if (i % 4 == 3 || i == len - 1u)
            REGS->TxData = word;
    }
    REGS->Ctrl = 0;
    command(SIE_SELECT(endpoint));
    command(SIE_VALIDATE);
}

/* At most `max` bytes are stored.  Returns the length, or -1 if a setup packet
 * has come in between. */
static int8_t read_packet(uint32_t endpoint, uint8_t *data, uint8_t max)
{
    uint32_t len, i, word = 0;

    REGS->Ctrl = USB_CTRL_READ(endpoint / 2);
    do {
        len = REGS->RxPLen;
    } while (!(len & USB_RXPLEN_READY));
    len &= USB_RXPLEN_LENGTH;
    for (i = 0; i < len; i++) {
        word = i % 4 ? word >> 8 : REGS->RxData;
        if (i < max)
            data[i] = (uint8_t)word;
    }
    REGS->Ctrl = 0;
    command(SIE_SELECT(endpoint));
    if (command_read(SIE_CLEAR_BUFFER) & SIE_BUFFER_OVERWRITTEN)
        return -1;
    return (int8_t)len;
}

/*
 * Endpoint 0
 */

static void start_device(void)
{
    irq_flag_t flag;

    realize(EP0_OUT, USB_EP0_SIZE);
    realize(EP0_IN, USB_EP0_SIZE);
    REGS->EpIntEn = 1u << EP0_OUT | 1u << EP0_IN;
    command_write(SIE_SET_ADDRESS, SIE_ADDRESS_ENABLE);
    has_setup = has_ep0_data = waits_for_ep0 = false;
    flag = irq_save();
    usb_note_reset();
    irq_restore(flag);
}

static void check_reset(void)
{
    if (!(REGS->DevIntSt & USB_INT_DEV_STAT))
        return;
    REGS->DevIntClr = USB_INT_DEV_STAT;
    if (command_read(SIE_DEVICE_STATUS) & SIE_STATUS_RESET)
        start_device();
}

static void poll_ep0(void)
{
    if (!(REGS->EpIntSt & 1u << EP0_OUT))
        return;
    has_setup = clear_interrupt(EP0_OUT) & SIE_SELECT_SETUP;
    has_ep0_data = !has_setup;
}

bool usb_take_setup(struct usb_setup *setup)
{
    check_reset();
    poll_ep0();
    while (has_setup) {
        has_setup = waits_for_ep0 = false;
        if (read_packet(EP0_OUT, (uint8_t *)setup, sizeof(*setup)) >= 0)
            return true;
        poll_ep0();
    }
    return false;
}

bool usb_ep0_send(const uint8_t *data, uint8_t len)
{
    waits_for_ep0 = is_full(EP0_IN);
    if (!waits_for_ep0)
        write_packet(EP0_IN, data, len);
    return !waits_for_ep0;
}

/* The empty packet that ends a transfer to the host is left for the next setup
 * packet, which takes its place. */
int8_t usb_ep0_receive(uint8_t *data, uint8_t max)
{
    poll_ep0();
    if (!has_ep0_data)
        return -1;
    has_ep0_data = false;
    return read_packet(EP0_OUT, data, max);
}

/* Until the next setup packet. */
void usb_ep0_stall(void)
{
    command_write(SIE_ENDPOINT_STATUS(EP0_OUT), SIE_ENDPOINT_STALLED);
    command_write(SIE_ENDPOINT_STATUS(EP0_IN), SIE_ENDPOINT_STALLED);
}

bool usb_set_address(uint8_t address)
{
    waits_for_ep0 = is_full(EP0_IN);
    if (waits_for_ep0)
        return false;
    command_write(SIE_SET_ADDRESS, SIE_ADDRESS_ENABLE | address);
    return true;
}

/*
 * The others
 */

void usb_set_configured(void)
{
#if !CONFIG_USBCANBUS
    realize(2 * USB_EP_NOTIFY + 1, USB_NOTIFY_SIZE);
#endif
    realize(BULK_OUT, USB_BULK_SIZE);
    realize(BULK_IN, USB_BULK_SIZE);
    REGS->EpIntEn |= 1u << BULK_OUT | 1u << BULK_IN;
    command_write(SIE_CONFIGURE, 1);
}

int8_t usb_receive(uint8_t *data)
{
    if (!is_full(BULK_OUT))
        return -1;
    return read_packet(BULK_OUT, data, USB_BULK_SIZE);
}

bool usb_send(const uint8_t *data, uint8_t len)
{
    if (is_full(BULK_IN))
        return false;
    write_packet(BULK_IN, data, len);
    return true;
}

/*
 * Interrupts
 */

static bool can_go_on(uint8_t events)
{
    return REGS->EpIntSt & 1u << EP0_OUT
        || (events & USB_WAIT_EP0 && waits_for_ep0 && !is_full(EP0_IN))
        || (events & USB_WAIT_OUT && is_full(BULK_OUT))
        || (events & USB_WAIT_IN && !is_full(BULK_IN));
}

/* What has come is no news; look at what is waited for, then listen. */
void usb_wait_for(uint8_t events)
{
    uint32_t pending = REGS->EpIntSt & ~(1u << EP0_OUT);

    REGS->DevIntClr = USB_INT_EP_SLOW;
    while (pending) {
        uint32_t endpoint = (uint32_t)__builtin_ctz(pending);

        pending &= pending - 1;
        clear_interrupt(endpoint);
    }
    if (can_go_on(events))
        usb_note();
    REGS->DevIntEn = INTERRUPTS;
}

void usb_irq(void)
{
    REGS->DevIntEn = 0;
    usb_note();
}

void usb_enter_bootloader(void)
{
    reset_to_bootloader();
}

void usb_init(void)
{
    chip_enable(USB_POWER);
    USB_CLK_CTRL = USB_CLK_DEVICE;
    while ((USB_CLK_ST & USB_CLK_DEVICE) != USB_CLK_DEVICE)
        ;
    gpio_alternate(GPIO(0, 29), 1, 0);
    gpio_alternate(GPIO(0, 30), 1, 0);
    gpio_alternate(GPIO(2, 9), 1, 0);
    REGS->DevIntEn = 0;
    REGS->EpIntPri = 0;
    start_device();
    command_write(SIE_SET_MODE, 0);
    armcm_connect(USB_IRQ, usb_irq);
    command_write(SIE_DEVICE_STATUS, SIE_STATUS_CONNECT);
    REGS->DevIntEn = INTERRUPTS;
}
DECL_INIT(usb_init);
