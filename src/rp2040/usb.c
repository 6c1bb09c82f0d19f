/* SPDX-License-Identifier: GPL-3.0-or-later
 * The USB device controller (data sheet, 4.1).
 *
 * Packets lie in its memory: each endpoint and direction has one buffer here
 * and a word that says whose it is.  Interrupts wake the task, which looks at
 * these.
 */
#include "board/irq.h"
#include "board/reset.h"
#include "board/usb.h"
#include "chip.h"
#include "core/sched.h"

#define REGS ((struct usb_regs *)USB_BASE)
#define MEMORY ((struct usb_memory *)USB_MEMORY_BASE)

/* Buffers by offset in the controller's memory */
#define DATA_OFFSET 0x180
#define BUFFER_OFFSET(EP) (DATA_OFFSET + 64 * ((EP) - 1))
#define BUFFER(EP) (&MEMORY->data[64 * ((EP) - 1)])

#define INTERRUPTS (USB_INT_BUFF_STATUS | USB_INT_BUS_RESET | USB_INT_SETUP)

/* DATA0 or DATA1: the next packet */
static uint32_t next_ep0, next_in, next_out;
/* A setup packet has come; it asks for data; endpoint 0 can receive. */
static volatile bool has_setup;
static bool is_to_host, is_ep0_armed;

/* The controller may look at a buffer only when the rest of its word has
 * arrived in its clock, which is slower than ours (data sheet, 4.1.2.5.1). */
static void hand_over(volatile uint32_t *word, uint32_t value)
{
    *word = value;
    __asm__ volatile("nop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\t"
                     "nop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop");
    *word = value | USB_BUFFER_AVAILABLE;
}

/* Bytes, one by one: its memory is not cached, and packets are small. */
static void copy_in(volatile uint8_t *to, const uint8_t *from, uint32_t len)
{
    while (len--)
        *to++ = *from++;
}

static void copy_out(uint8_t *to, const volatile uint8_t *from, uint32_t len)
{
    while (len--)
        *to++ = *from++;
}

/*
 * Endpoint 0
 */

static void arm_ep0_out(void)
{
    hand_over(&MEMORY->buffer[0].out, USB_BUFFER_DATA1 | USB_EP0_SIZE);
    is_ep0_armed = true;
}

/* What is left of an older transfer is void. */
bool usb_take_setup(struct usb_setup *setup)
{
    if (!has_setup)
        return false;
    MEMORY->buffer[0].in = MEMORY->buffer[0].out = 0;
    do {
        has_setup = false;
        copy_out((uint8_t *)setup, MEMORY->setup, sizeof(*setup));
    } while (has_setup);
    next_ep0 = USB_BUFFER_DATA1;
    is_to_host = setup->type & 0x80;
    is_ep0_armed = false;
    return true;
}

/* The host ends a transfer of data to it with an empty packet from it. */
bool usb_ep0_send(const uint8_t *data, uint8_t len)
{
    if (MEMORY->buffer[0].in & USB_BUFFER_AVAILABLE)
        return false;
    copy_in(MEMORY->ep0, data, len);
    hand_over(&MEMORY->buffer[0].in, USB_BUFFER_FULL | next_ep0 | len);
    next_ep0 ^= USB_BUFFER_DATA1;
    if (is_to_host && !is_ep0_armed)
        arm_ep0_out();
    return true;
}

/* Length of a packet that has come, or -1. */
static int8_t length_of(uint32_t word)
{
    if (!(word & USB_BUFFER_FULL) || word & USB_BUFFER_AVAILABLE)
        return -1;
    return (int8_t)(word & USB_BUFFER_LENGTH);
}

int8_t usb_ep0_receive(uint8_t *data, uint8_t max)
{
    int8_t len = length_of(MEMORY->buffer[0].out);

    if (!is_ep0_armed)
        arm_ep0_out();
    else if (len >= 0)
        copy_out(data, MEMORY->ep0, len < max ? (uint8_t)len : max);
    return len;
}

void usb_ep0_stall(void)
{
    RP_SET(REGS->EP_STALL_ARM) = 3;
    MEMORY->buffer[0].in = USB_BUFFER_STALL;
    MEMORY->buffer[0].out = USB_BUFFER_STALL;
}

bool usb_set_address(uint8_t address)
{
    if (MEMORY->buffer[0].in & USB_BUFFER_AVAILABLE)
        return false;
    REGS->ADDR_CTRL = address;
    return true;
}

/*
 * The others
 */

static void arm_out(void)
{
    hand_over(&MEMORY->buffer[USB_EP_OUT].out, next_out | USB_BULK_SIZE);
    next_out ^= USB_BUFFER_DATA1;
}

void usb_set_configured(void)
{
    MEMORY->control[USB_EP_IN - 1].in = USB_CONTROL_ENABLE | USB_CONTROL_INT
        | USB_CONTROL_BULK | BUFFER_OFFSET(USB_EP_IN);
    MEMORY->control[USB_EP_OUT - 1].out = USB_CONTROL_ENABLE | USB_CONTROL_INT
        | USB_CONTROL_BULK | BUFFER_OFFSET(USB_EP_OUT);
#if !CONFIG_USBCANBUS
    MEMORY->control[USB_EP_NOTIFY - 1].in = USB_CONTROL_ENABLE
        | USB_CONTROL_INTERRUPT | BUFFER_OFFSET(USB_EP_NOTIFY);
#endif
    MEMORY->buffer[USB_EP_IN].in = 0;
    next_in = next_out = 0;
    arm_out();
}

int8_t usb_receive(uint8_t *data)
{
    int8_t len = length_of(MEMORY->buffer[USB_EP_OUT].out);

    if (len < 0)
        return len;
    copy_out(data, BUFFER(USB_EP_OUT), (uint8_t)len);
    arm_out();
    return len;
}

bool usb_send(const uint8_t *data, uint8_t len)
{
    if (MEMORY->buffer[USB_EP_IN].in & USB_BUFFER_AVAILABLE)
        return false;
    copy_in(BUFFER(USB_EP_IN), data, len);
    hand_over(&MEMORY->buffer[USB_EP_IN].in, USB_BUFFER_FULL | next_in | len);
    next_in ^= USB_BUFFER_DATA1;
    return true;
}

/*
 * Interrupts
 */

/* Each packet interrupts, once. */
void usb_wait_for(uint8_t events)
{
    (void)events;
}

void usb_irq(void)
{
    uint32_t events = REGS->INTS;

    if (events & USB_INT_BUS_RESET) {
        REGS->SIE_STATUS = USB_STATUS_BUS_RESET;
        REGS->ADDR_CTRL = 0;
        has_setup = false;
        usb_note_reset();
    }
    if (events & USB_INT_SETUP) {
        REGS->SIE_STATUS = USB_STATUS_SETUP;
        has_setup = true;
    }
    REGS->BUFF_STATUS = REGS->BUFF_STATUS;
    usb_note();
}

void usb_enter_bootloader(void)
{
    reset_to_bootloader();
}

void usb_init(void)
{
    uint32_t i;

    chip_enable(RESET_USBCTRL);
    for (i = 0; i < sizeof(*MEMORY) / 4; i++)
        ((volatile uint32_t *)MEMORY)[i] = 0;
    REGS->USB_MUXING = USB_MUXING_PHY_SOFTCON;
    REGS->USB_PWR = USB_PWR_DETECT_OVERRIDE;
    REGS->MAIN_CTRL = USB_MAIN_ENABLE;
    armcm_connect(USBCTRL_IRQ, usb_irq);
    REGS->INTE = INTERRUPTS;
    REGS->SIE_CTRL = USB_SIE_EP0_INT | USB_SIE_PULLUP;
}
DECL_INIT(usb_init);
