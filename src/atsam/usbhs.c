/* SPDX-License-Identifier: GPL-3.0-or-later
 * The USB controller of SAM3X and SAM E70, at full speed (11057, 39.5).
 *
 * The interrupt masks itself and wakes the task, which looks at the endpoints.
 */
#include "atsam/usbhs.h"
#include "board/irq.h"
#include "board/reset.h"
#include "board/usb.h"
#include "chip.h"
#include "core/sched.h"

#define REGS ((struct usbhs_regs *)USBHS_BASE)
#define PLL_COUNT 15u

/* The task waits for a free buffer of endpoint 0. */
static bool waits_for_ep0;

static void enable_endpoint(uint32_t endpoint, uint32_t config)
{
    REGS->DEVEPT |= 1u << endpoint;
    REGS->DEVEPTCFG[endpoint] = config | USBHS_CFG_ALLOC;
}

/*
 * Packets
 */

static bool is_up(uint32_t endpoint, uint32_t flag)
{
    return REGS->DEVEPTISR[endpoint] & flag;
}

static void fill(uint32_t endpoint, const uint8_t *data, uint8_t len)
{
    while (len--)
        *USBHS_FIFO(endpoint) = *data++;
    /* all of it before the buffer is given away */
    __asm__ volatile("dsb" ::: "memory");
}

/* At most `max` bytes are stored; returns how many there were. */
static int8_t empty(uint32_t endpoint, uint8_t *data, uint8_t max)
{
    uint32_t len = USBHS_EPT_COUNT(REGS->DEVEPTISR[endpoint]), i;

    for (i = 0; i < len; i++) {
        uint8_t byte = *USBHS_FIFO(endpoint);

        if (i < max)
            data[i] = byte;
    }
    return (int8_t)len;
}

/*
 * Endpoint 0: to clear a flag gives the buffer away
 */

bool usb_take_setup(struct usb_setup *setup)
{
    if (!is_up(0, USBHS_EPT_RXSTP))
        return false;
    empty(0, (uint8_t *)setup, sizeof(*setup));
    REGS->DEVEPTICR[0] = USBHS_EPT_RXSTP | USBHS_EPT_RXOUT;
    waits_for_ep0 = false;
    return true;
}

bool usb_ep0_send(const uint8_t *data, uint8_t len)
{
    waits_for_ep0 = !is_up(0, USBHS_EPT_TXIN);
    if (waits_for_ep0)
        return false;
    fill(0, data, len);
    REGS->DEVEPTICR[0] = USBHS_EPT_TXIN;
    return true;
}

int8_t usb_ep0_receive(uint8_t *data, uint8_t max)
{
    int8_t len;

    if (!is_up(0, USBHS_EPT_RXOUT))
        return -1;
    len = empty(0, data, max);
    REGS->DEVEPTICR[0] = USBHS_EPT_RXOUT;
    return len;
}

void usb_ep0_stall(void)
{
    REGS->DEVEPTIER[0] = USBHS_EPT_STALLRQ;
}

bool usb_set_address(uint8_t address)
{
    waits_for_ep0 = !is_up(0, USBHS_EPT_TXIN);
    if (waits_for_ep0)
        return false;
    REGS->DEVCTRL = USBHS_DEVCTRL_FULL_SPEED | USBHS_DEVCTRL_ADDEN | address;
    return true;
}

/*
 * The others: FIFOCON gives the buffer away
 */

/* They get their memory in the order of their numbers. */
static const uint16_t configs[USB_EP_COUNT] = {
#if !CONFIG_USBCANBUS
    [USB_EP_NOTIFY] = USBHS_CFG_INTERRUPT | USBHS_CFG_IN | USBHS_CFG_SIZE_8,
#endif
    [USB_EP_OUT] = USBHS_CFG_BULK | USBHS_CFG_SIZE_64 | USBHS_CFG_TWO_BANKS,
    [USB_EP_IN] = USBHS_CFG_BULK | USBHS_CFG_IN | USBHS_CFG_SIZE_64
        | USBHS_CFG_TWO_BANKS,
};

void usb_set_configured(void)
{
    uint32_t endpoint;

    for (endpoint = 1; endpoint < USB_EP_COUNT; endpoint++)
        enable_endpoint(endpoint, configs[endpoint]);
}

int8_t usb_receive(uint8_t *data)
{
    int8_t len;

    if (!is_up(USB_EP_OUT, USBHS_EPT_RXOUT))
        return -1;
    REGS->DEVEPTICR[USB_EP_OUT] = USBHS_EPT_RXOUT;
    len = empty(USB_EP_OUT, data, USB_BULK_SIZE);
    REGS->DEVEPTIDR[USB_EP_OUT] = USBHS_EPT_FIFOCON;
    return len;
}

bool usb_send(const uint8_t *data, uint8_t len)
{
    if (!is_up(USB_EP_IN, USBHS_EPT_TXIN))
        return false;
    REGS->DEVEPTICR[USB_EP_IN] = USBHS_EPT_TXIN;
    fill(USB_EP_IN, data, len);
    REGS->DEVEPTIDR[USB_EP_IN] = USBHS_EPT_FIFOCON;
    return true;
}

/*
 * Interrupts
 */

static void listen(uint32_t endpoint, uint32_t flag, bool on)
{
    if (on)
        REGS->DEVEPTIER[endpoint] = flag;
    else
        REGS->DEVEPTIDR[endpoint] = flag;
}

/* What nobody waits for would interrupt for ever. */
void usb_wait_for(uint8_t events)
{
    bool is_busy = events & USB_WAIT_EP0;

    listen(0, USBHS_EPT_RXSTP, true);
    listen(0, USBHS_EPT_TXIN, is_busy && waits_for_ep0);
    listen(0, USBHS_EPT_RXOUT, is_busy && !waits_for_ep0);
    listen(USB_EP_OUT, USBHS_EPT_RXOUT, events & USB_WAIT_OUT);
    listen(USB_EP_IN, USBHS_EPT_TXIN, events & USB_WAIT_IN);
    REGS->DEVIER = USBHS_INT_ENDPOINT(0) | USBHS_INT_ENDPOINT(USB_EP_OUT)
        | USBHS_INT_ENDPOINT(USB_EP_IN);
}

void usbhs_irq(void)
{
    if (REGS->DEVISR & USBHS_INT_EORST) {
        REGS->DEVICR = USBHS_INT_EORST;
        REGS->DEVCTRL = USBHS_DEVCTRL_FULL_SPEED | USBHS_DEVCTRL_ADDEN;
        enable_endpoint(0, USBHS_CFG_SIZE_64);
        usb_note_reset();
    }
    REGS->DEVIDR = USBHS_INT_ENDPOINTS;
    usb_note();
}

void usb_enter_bootloader(void)
{
    reset_to_bootloader();
}

void usbhs_init(void)
{
    PMC->UCKR = PMC_UCKR_UPLLEN | PMC_UCKR_COUNT(PLL_COUNT);
    while (!(PMC->SR & PMC_SR_LOCKU))
        ;
    PMC->USB = PMC_USB_UPLL_10;
    PMC->SCER = PMC_SCER_USB;
    chip_enable(USBHS_ID);
    REGS->CTRL = USBHS_CTRL_USBE | USBHS_CTRL_UIMOD_DEVICE
        | (CONFIG_MACH_SAM3X ? USBHS_CTRL_OTGPADE : 0);
    while (!(REGS->SR & USBHS_SR_CLKUSABLE))
        ;
    armcm_connect(USBHS_ID, usbhs_irq);
    REGS->DEVIER = USBHS_INT_EORST;
    REGS->DEVCTRL = USBHS_DEVCTRL_FULL_SPEED;
}
DECL_INIT(usbhs_init);
