/* SPDX-License-Identifier: GPL-3.0-or-later
 * The USB device controller (data sheets, USB).
 *
 * It finds packets by descriptors in memory, two banks an endpoint.  Flags of
 * endpoints tell whose a bank is; their interrupts are off until waited for.
 */
#include "board/irq.h"
#include "board/reset.h"
#include "board/usb.h"
#include "chip.h"
#include "core/sched.h"

DECL_CONSTANT_STR("RESERVE_PINS_USB", "PA24,PA25");

#define REGS ((struct usb_regs *)USB_BASE)
#define EP0 (&REGS->EP[0])
enum { BANK_OUT, BANK_IN };

static struct usb_bank banks[USB_EP_COUNT][2] __attribute__((aligned(4)));
static uint8_t ep0_out[USB_EP0_SIZE] __attribute__((aligned(4)));
static uint8_t ep0_in[USB_EP0_SIZE] __attribute__((aligned(4)));
static uint8_t bulk_out[USB_BULK_SIZE] __attribute__((aligned(4)));
static uint8_t bulk_in[USB_BULK_SIZE] __attribute__((aligned(4)));

/* Bytes, one by one: the controller writes them behind the compiler's back. */
static void copy(volatile uint8_t *to, const volatile uint8_t *from,
                 uint32_t len)
{
    while (len--)
        *to++ = *from++;
}

static uint32_t length_of(struct usb_bank *bank)
{
    return bank->PCKSIZE & USB_PCKSIZE_COUNT;
}

static void set_length(struct usb_bank *bank, uint32_t len)
{
    bank->PCKSIZE = (bank->PCKSIZE & ~(USB_PCKSIZE_COUNT | 0xfffc000u)) | len;
}

/*
 * Endpoint 0
 */

bool usb_take_setup(struct usb_setup *setup)
{
    if (!(EP0->INTFLAG & USB_EPINT_RXSTP))
        return false;
    copy((uint8_t *)setup, ep0_out, sizeof(*setup));
    EP0->STATUSCLR = USB_EP_BK1RDY | USB_EP_BK0RDY;
    EP0->INTFLAG = USB_EPINT_RXSTP | USB_EPINT_TRCPT0 | USB_EPINT_TRCPT1;
    return true;
}

bool usb_ep0_send(const uint8_t *data, uint8_t len)
{
    if (EP0->STATUS & USB_EP_BK1RDY)
        return false;
    copy(ep0_in, data, len);
    set_length(&banks[0][BANK_IN], len);
    EP0->INTFLAG = USB_EPINT_TRCPT1;
    EP0->STATUSSET = USB_EP_BK1RDY;
    return true;
}

int8_t usb_ep0_receive(uint8_t *data, uint8_t max)
{
    uint32_t len;

    if (!(EP0->INTFLAG & USB_EPINT_TRCPT0))
        return -1;
    len = length_of(&banks[0][BANK_OUT]);
    copy(data, ep0_out, len < max ? len : max);
    EP0->INTFLAG = USB_EPINT_TRCPT0;
    EP0->STATUSCLR = USB_EP_BK0RDY;
    return (int8_t)len;
}

void usb_ep0_stall(void)
{
    EP0->STATUSSET = USB_EP_STALLRQ0 | USB_EP_STALLRQ1;
}

bool usb_set_address(uint8_t address)
{
    if (EP0->STATUS & USB_EP_BK1RDY)
        return false;
    REGS->DADD = address | USB_DADD_ADDEN;
    return true;
}

/*
 * The others
 */

static void set_bank(uint32_t endpoint, uint32_t bank, uint8_t *data,
                     uint32_t size)
{
    banks[endpoint][bank].ADDR = (uint32_t)data;
    banks[endpoint][bank].PCKSIZE = USB_PCKSIZE_SIZE(size);
}

/* An OUT bank that is not "ready" can be filled; both data toggles begin
 * anew. */
void usb_set_configured(void)
{
    struct usb_endpoint_regs *in = &REGS->EP[USB_EP_IN];
    struct usb_endpoint_regs *out = &REGS->EP[USB_EP_OUT];

    set_bank(USB_EP_IN, BANK_IN, bulk_in, USB_BULK_SIZE);
    set_bank(USB_EP_OUT, BANK_OUT, bulk_out, USB_BULK_SIZE);
#if !CONFIG_USBCANBUS
    REGS->EP[USB_EP_NOTIFY].EPCFG = USB_EPCFG(0, USB_TYPE_INTERRUPT);
#endif
    in->EPCFG = USB_EPCFG(0, USB_TYPE_BULK);
    in->STATUSCLR = USB_EP_BK1RDY | USB_EP_DTGLIN;
    out->EPCFG = USB_EPCFG(USB_TYPE_BULK, 0);
    out->STATUSCLR = USB_EP_BK0RDY | USB_EP_DTGLOUT;
}

int8_t usb_receive(uint8_t *data)
{
    struct usb_endpoint_regs *out = &REGS->EP[USB_EP_OUT];
    uint32_t len;

    if (!(out->STATUS & USB_EP_BK0RDY))
        return -1;
    len = length_of(&banks[USB_EP_OUT][BANK_OUT]);
    copy(data, bulk_out, len);
    out->INTFLAG = USB_EPINT_TRCPT0;
    out->STATUSCLR = USB_EP_BK0RDY;
    return (int8_t)len;
}

bool usb_send(const uint8_t *data, uint8_t len)
{
    struct usb_endpoint_regs *in = &REGS->EP[USB_EP_IN];

    if (in->STATUS & USB_EP_BK1RDY)
        return false;
    copy(bulk_in, data, len);
    set_length(&banks[USB_EP_IN][BANK_IN], len);
    in->INTFLAG = USB_EPINT_TRCPT1;
    in->STATUSSET = USB_EP_BK1RDY;
    return true;
}

/*
 * Interrupts
 */

static void allow(struct usb_endpoint_regs *endpoint, uint8_t flags)
{
    endpoint->INTENCLR = (uint8_t)~flags;
    endpoint->INTENSET = flags;
}

void usb_wait_for(uint8_t events)
{
    irq_flag_t flag = irq_save();

    allow(EP0, USB_EPINT_RXSTP
          | (events & USB_WAIT_EP0 ? USB_EPINT_TRCPT0 | USB_EPINT_TRCPT1 : 0));
    allow(&REGS->EP[USB_EP_OUT], events & USB_WAIT_OUT ? USB_EPINT_TRCPT0 : 0);
    allow(&REGS->EP[USB_EP_IN], events & USB_WAIT_IN ? USB_EPINT_TRCPT1 : 0);
    irq_restore(flag);
}

/* After a reset of the bus only endpoint 0 is there. */
static void restart(void)
{
    REGS->INTFLAG = USB_INT_EORST;
    REGS->DADD = USB_DADD_ADDEN;
    EP0->EPCFG = USB_EPCFG(USB_TYPE_CONTROL, USB_TYPE_CONTROL);
    EP0->STATUSCLR = USB_EP_BK0RDY | USB_EP_BK1RDY;
    allow(EP0, USB_EPINT_RXSTP);
    usb_note_reset();
}

void usb_irq(void)
{
    if (REGS->INTFLAG & USB_INT_EORST)
        restart();
    allow(EP0, 0);
    allow(&REGS->EP[USB_EP_OUT], 0);
    allow(&REGS->EP[USB_EP_IN], 0);
    usb_note();
}

void usb_enter_bootloader(void)
{
    reset_to_bootloader();
}

static void connect_irqs(void)
{
    uint32_t i;

    for (i = 0; i < (CONFIG_MACH_SAMX5 ? 4 : 1); i++)
        armcm_connect(USB_IRQ + i, usb_irq);
}

void usb_init(void)
{
    chip_enable(USB_GATE);
    chip_enable(CONFIG_MACH_SAMX5 ? GATE_AHB(10) : GATE_AHB(6));
    chip_feed(CHANNEL_USB, GEN_PERIPHERALS);
    gpio_mux(GPIO('A', 24), USB_MUX, 0);
    gpio_mux(GPIO('A', 25), USB_MUX, 0);
    REGS->CTRLA = USB_CTRLA_SWRST;
    while (REGS->SYNCBUSY)
        ;
    REGS->PADCAL = (uint16_t)(NVM_USB_TRANSP | NVM_USB_TRANSN << 6
                              | NVM_USB_TRIM << 12);
    set_bank(0, BANK_OUT, ep0_out, USB_EP0_SIZE);
    set_bank(0, BANK_IN, ep0_in, USB_EP0_SIZE);
    REGS->DESCADD = (uint32_t)banks;
    REGS->CTRLA = USB_CTRLA_ENABLE;
    while (REGS->SYNCBUSY)
        ;
    connect_irqs();
    REGS->INTENSET = USB_INT_EORST;
    REGS->CTRLB = 0; /* full speed, attached */
}
DECL_INIT(usb_init);
