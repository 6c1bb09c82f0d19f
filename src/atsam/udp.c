/* SPDX-License-Identifier: GPL-3.0-or-later
 * The USB device port of SAM4S and SAM4E (11100, 40.6).
 *
 * The interrupt masks itself and wakes the task, which looks at the endpoints'
 * flags.
 */
#include "atsam/udp.h"
#include "board/irq.h"
#include "board/reset.h"
#include "board/usb.h"
#include "chip.h"
#include "core/sched.h"

DECL_CONSTANT_STR("RESERVE_PINS_USB", "PB10,PB11");

#define REGS ((struct udp_regs *)UDP_BASE)

/* Of the two buffers of the bulk endpoint from the host, the next one */
static uint32_t next_bank;

/* Flags are in another clock: what was written is waited for (40.7.10).  Irqs
 * are off so that this ends before another packet can set the flag again. */
static void clear_flags(uint32_t endpoint, uint32_t flags)
{
    volatile uint32_t *csr = &REGS->CSR[endpoint];
    irq_flag_t flag = irq_save();

    *csr = (*csr | UDP_CSR_FLAGS) & ~flags;
    while (*csr & flags)
        ;
    irq_restore(flag);
}

static void set_flags(uint32_t endpoint, uint32_t flags)
{
    volatile uint32_t *csr = &REGS->CSR[endpoint];
    irq_flag_t flag = irq_save();

    *csr = *csr | UDP_CSR_FLAGS | flags;
    while ((*csr & flags) != flags)
        ;
    irq_restore(flag);
}

static void enable_endpoint(uint32_t endpoint, uint32_t type)
{
    REGS->RST_EP |= 1u << endpoint;
    REGS->RST_EP &= ~(1u << endpoint);
    set_flags(endpoint, type | UDP_CSR_EPEDS);
}

/*
 * Packets
 */

static bool send_packet(uint32_t endpoint, const uint8_t *data, uint8_t len)
{
    if (REGS->CSR[endpoint] & UDP_CSR_TXPKTRDY)
        return false;
    if (REGS->CSR[endpoint] & UDP_CSR_TXCOMP)
        clear_flags(endpoint, UDP_CSR_TXCOMP);
    while (len--)
        REGS->FDR[endpoint] = *data++;
    set_flags(endpoint, UDP_CSR_TXPKTRDY);
    return true;
}

/* At most `max` bytes are stored; the flag gives the buffer back. */
static int8_t read_packet(uint32_t endpoint, uint32_t flag, uint8_t *data,
                          uint8_t max)
{
    uint32_t len = UDP_CSR_COUNT(REGS->CSR[endpoint]), i;

    for (i = 0; i < len; i++) {
        uint8_t byte = (uint8_t)REGS->FDR[endpoint];

        if (i < max)
            data[i] = byte;
    }
    clear_flags(endpoint, flag);
    return (int8_t)len;
}

/*
 * Endpoint 0
 */

/* Its direction must be known before the flag is cleared. */
bool usb_take_setup(struct usb_setup *setup)
{
    uint8_t *bytes = (uint8_t *)setup;
    uint32_t i;

    if (!(REGS->CSR[0] & UDP_CSR_RXSETUP))
        return false;
    for (i = 0; i < sizeof(*setup); i++)
        bytes[i] = (uint8_t)REGS->FDR[0];
    clear_flags(0, UDP_CSR_TXCOMP | UDP_CSR_RX_BK0 | UDP_CSR_STALLSENT
                | UDP_CSR_FORCESTALL | UDP_CSR_DIR_IN);
    if (setup->type & 0x80)
        set_flags(0, UDP_CSR_DIR_IN);
    clear_flags(0, UDP_CSR_RXSETUP);
    return true;
}

bool usb_ep0_send(const uint8_t *data, uint8_t len)
{
    return send_packet(0, data, len);
}

int8_t usb_ep0_receive(uint8_t *data, uint8_t max)
{
    if (!(REGS->CSR[0] & UDP_CSR_RX_BK0))
        return -1;
    return read_packet(0, UDP_CSR_RX_BK0, data, max);
}

void usb_ep0_stall(void)
{
    set_flags(0, UDP_CSR_FORCESTALL);
}

bool usb_set_address(uint8_t address)
{
    if (REGS->CSR[0] & UDP_CSR_TXPKTRDY)
        return false;
    REGS->FADDR = UDP_FADDR_FEN | address;
    REGS->GLB_STAT = UDP_GLB_ADDRESSED;
    return true;
}

/*
 * The others
 */

void usb_set_configured(void)
{
    enable_endpoint(USB_EP_NOTIFY, UDP_CSR_INTERRUPT_IN);
    enable_endpoint(USB_EP_OUT, UDP_CSR_BULK_OUT);
    enable_endpoint(USB_EP_IN, UDP_CSR_BULK_IN);
    next_bank = UDP_CSR_RX_BK0;
    REGS->GLB_STAT = UDP_GLB_ADDRESSED | UDP_GLB_CONFIGURED;
}

int8_t usb_receive(uint8_t *data)
{
    int8_t len;

    if (!(REGS->CSR[USB_EP_OUT] & next_bank))
        return -1;
    len = read_packet(USB_EP_OUT, next_bank, data, USB_BULK_SIZE);
    next_bank ^= UDP_CSR_RX_BK0 | UDP_CSR_RX_BK1;
    return len;
}

bool usb_send(const uint8_t *data, uint8_t len)
{
    return send_packet(USB_EP_IN, data, len);
}

/*
 * Interrupts
 */

/* A flag that nobody waits for would interrupt for ever; the empty packet that
 * ends a transfer to the host is such. */
void usb_wait_for(uint8_t events)
{
    uint32_t ep0 = UDP_CSR_STALLSENT, mask = 1u << 0;

    if (!(events & USB_WAIT_EP0))
        ep0 |= UDP_CSR_TXCOMP;
    if (REGS->CSR[0] & UDP_CSR_DIR_IN)
        ep0 |= UDP_CSR_RX_BK0;
    if (REGS->CSR[0] & ep0)
        clear_flags(0, ep0);
    if (events & USB_WAIT_OUT)
        mask |= 1u << USB_EP_OUT;
    if (events & USB_WAIT_IN)
        mask |= 1u << USB_EP_IN;
    REGS->IER = mask;
}

void udp_irq(void)
{
    if (REGS->ISR & UDP_INT_BUS_RESET) {
        REGS->ICR = UDP_INT_BUS_RESET;
        REGS->FADDR = UDP_FADDR_FEN;
        REGS->GLB_STAT = 0;
        enable_endpoint(0, 0);
        usb_note_reset();
    }
    REGS->IDR = 0xff;
    usb_note();
}

void usb_enter_bootloader(void)
{
    reset_to_bootloader();
}

void udp_init(void)
{
    PMC->USB = PMC_USB_PLLA_5;
    PMC->SCER = PMC_SCER_UDP;
    chip_enable(UDP_ID);
    armcm_connect(UDP_ID, udp_irq);
    REGS->TXVC = UDP_TXVC_PUON;
}
DECL_INIT(udp_init);
