/* SPDX-License-Identifier: GPL-3.0-or-later
 * The USB controller.  ATmega16U4/32U4 data sheet 7766, "USB controller" and
 * "USB device operating modes"; AT90USB64/128 data sheet 7593.
 *
 * An interrupt of an endpoint only wakes the task, which enables what it waits
 * for next.
 */
#include <avr/boot.h>
#include <avr/wdt.h>

#include "board/irq.h"
#include "board/usb.h"
#include "core/sched.h"

enum { N_ENDPOINTS = 4 };
enum { TYPE_CONTROL = 0, TYPE_BULK = 2, TYPE_INTERRUPT = 3 };
/* UECFG1X: the size is 8 << n, and a second bank for bulk data */
#define SIZE_OF(LOG2) ((uint8_t)(((LOG2) - 3) << EPSIZE0 | 1 << ALLOC))
#define TWO_BANKS (1 << EPBK0)

/* The host's clock: 48 MHz from the crystal */
#if CONFIG_AVR_U4
#define PLL_INPUT (CONFIG_CLOCK_FREQ == 16000000 ? 1 << PINDIV : 0)
#elif CONFIG_CLOCK_FREQ == 8000000
#define PLL_INPUT (1 << PLLP1 | 1 << PLLP0)
#elif CONFIG_MACH_at90usb1286
#define PLL_INPUT (1 << PLLP2 | 1 << PLLP0)
#else
#define PLL_INPUT (1 << PLLP2 | 1 << PLLP1)
#endif

static void set_up(uint8_t ep, uint8_t type, uint8_t is_in, uint8_t size)
{
    UENUM = ep;
    UECONX = 1 << EPEN;
    UECFG0X = (uint8_t)(type << EPTYPE0 | is_in << EPDIR);
    UECFG1X = size;
}

/* Bus reset has disabled all endpoints. */
ISR(USB_GEN_vect)
{
    uint8_t was = UENUM;

    if (UDINT & (1 << EORSTI)) {
        set_up(0, TYPE_CONTROL, 0, SIZE_OF(4));
        UEIENX = 1 << RXSTPE;
        usb_note_reset();
    }
    UDINT = 0;
    UENUM = was;
}

ISR(USB_COM_vect)
{
    uint8_t was = UENUM, ep;

    for (ep = 0; ep < N_ENDPOINTS; ep++) {
        UENUM = ep;
        UEIENX = 0;
    }
    UENUM = was;
    usb_note();
}

void usb_set_configured(void)
{
    set_up(USB_EP_NOTIFY, TYPE_INTERRUPT, 1, SIZE_OF(3));
    set_up(USB_EP_OUT, TYPE_BULK, 0, SIZE_OF(6) | TWO_BANKS);
    set_up(USB_EP_IN, TYPE_BULK, 1, SIZE_OF(6) | TWO_BANKS);
    UENUM = USB_EP_NOTIFY;
    UERST = (1 << USB_EP_NOTIFY) | (1 << USB_EP_OUT) | (1 << USB_EP_IN);
    UERST = 0;
}

static void read_fifo(uint8_t *data, uint8_t len)
{
    while (len--)
        *data++ = UEDATX;
}

static void write_fifo(const uint8_t *data, uint8_t len)
{
    while (len--)
        UEDATX = *data++;
}

/* Flags are cleared by zeros. */
static void clear_flags(uint8_t flags)
{
    UEINTX = (uint8_t)~flags;
}

bool usb_take_setup(struct usb_setup *setup)
{
    UENUM = 0;
    if (!(UEINTX & (1 << RXSTPI)))
        return false;
    read_fifo((uint8_t *)setup, sizeof(*setup));
    clear_flags(1 << RXSTPI | 1 << RXOUTI);
    return true;
}

bool usb_ep0_send(const uint8_t *data, uint8_t len)
{
    UENUM = 0;
    if (!(UEINTX & (1 << TXINI)))
        return false;
    write_fifo(data, len);
    clear_flags(1 << TXINI);
    return true;
}

int8_t usb_ep0_receive(uint8_t *data, uint8_t max)
{
    uint8_t len;

    UENUM = 0;
    if (!(UEINTX & (1 << RXOUTI)))
        return -1;
    len = UEBCLX;
    if (len > max)
        len = max;
    read_fifo(data, len);
    clear_flags(1 << RXOUTI);
    return (int8_t)len;
}

void usb_ep0_stall(void)
{
    UENUM = 0;
    UECONX = 1 << STALLRQ | 1 << EPEN;
}

bool usb_set_address(uint8_t address)
{
    UENUM = 0;
    if (!(UEINTX & (1 << TXINI)))
        return false;
    UDADDR = address;
    UDADDR = (uint8_t)(1 << ADDEN | address);
    return true;
}

int8_t usb_receive(uint8_t *data)
{
    uint8_t len;

    UENUM = USB_EP_OUT;
    if (!(UEINTX & (1 << RXOUTI)))
        return -1;
    len = UEBCLX;
    read_fifo(data, len);
    clear_flags(1 << RXOUTI | 1 << FIFOCON);
    return (int8_t)len;
}

bool usb_send(const uint8_t *data, uint8_t len)
{
    UENUM = USB_EP_IN;
    if (!(UEINTX & (1 << TXINI)))
        return false;
    /* a shutdown came while the last packet was written: let it go first */
    if (!UEBCLX)
        write_fifo(data, len);
    else
        len = 0;
    clear_flags(1 << TXINI | 1 << FIFOCON);
    return len > 0;
}

void usb_wait_for(uint8_t events)
{
    irq_flag_t flag = irq_save();

    UENUM = USB_EP_OUT;
    UEIENX = events & USB_WAIT_OUT ? 1 << RXOUTE : 0;
    UENUM = USB_EP_IN;
    UEIENX = events & USB_WAIT_IN ? 1 << TXINE : 0;
    UENUM = 0;
    UEIENX = (uint8_t)(1 << RXSTPE | (events & USB_WAIT_EP0
                                      ? 1 << RXOUTE | 1 << TXINE : 0));
    irq_restore(flag);
}

/* Leave the bus, long enough for the host to see it. */
static void detach(void)
{
    UDCON = 1 << DETACH;
    USBCON = 1 << FRZCLK;
    PLLCSR = 0;
    PORT_DELAY_TICKS(CONFIG_CLOCK_FREQ / 50);
}

#if CONFIG_AVR_U4
/* The boot loaders of the Arduino family take new firmware after a watchdog
 * reset with this number at either place. */
#define BOOT_KEY 0x7777
void usb_enter_bootloader(void)
{
    irq_disable();
    detach();
    *(volatile uint16_t *)0x0800 = BOOT_KEY;
    *(volatile uint16_t *)(RAMEND - 1) = BOOT_KEY;
    wdt_enable(WDTO_15MS);
    for (;;)
        ;
}
#else
/* The section of the boot loader: its size is in the fuses. */
void usb_enter_bootloader(void)
{
    uint8_t size_code;
    uint32_t start;

    irq_disable();
    wdt_disable();
    size_code = (boot_lock_fuse_bits_get(GET_HIGH_FUSE_BITS) >> 1) & 3;
    start = FLASHEND + 1ul - (8192ul >> size_code);
    detach();
    TIMSK1 = 0;
    UDIEN = 0;
    __asm__ volatile("ijmp" : : "z"((uint16_t)(start >> 1)));
    __builtin_unreachable();
}
#endif

void usb_init(void)
{
    UHWCON = 1 << UVREGE;
#ifdef UIMOD
    UHWCON |= 1 << UIMOD;       /* a device, whatever the id pin says */
#endif
    USBCON = 1 << USBE | 1 << FRZCLK;
    PLLCSR = PLL_INPUT;
    PLLCSR = PLL_INPUT | 1 << PLLE;
    while (!(PLLCSR & (1 << PLOCK)))
        ;
    USBCON = 1 << USBE | 1 << OTGPADE;
    UDCON = 0;
    UDIEN = 1 << EORSTE;
}
DECL_INIT(usb_init);
