/* SPDX-License-Identifier: GPL-3.0-or-later
 * The packet memory of the full-speed USB device (RM0008, 23.5.3; RM0444,
 * 37.6.3 for the G0).
 */
#include "board/usb.h"
#include "chip.h"
#include "stm32/usbfs.h"
#include "usb_memory.h"

/* Behind the table: both directions of endpoint 0, then one of each other */
#define TABLE_SIZE 64u
#define TX_START(EP) (TABLE_SIZE + USB_BULK_SIZE * (EP))
#define RX_START(EP) ((EP) ? TX_START(EP) : TABLE_SIZE + 64u * USB_EP_COUNT)

#if CONFIG_MACH_STM32G0

typedef uint32_t unit_t;
#define UNIT(ADDR) (*(volatile uint32_t *)(USB_PMA + (ADDR)))
#define ENTRY(EP, WORD) UNIT(8 * (EP) + 4 * (WORD))

void usb_memory_place(uint32_t ep)
{
    ENTRY(ep, 0) = TX_START(ep);
    ENTRY(ep, 1) = RX_START(ep) | USB_RX_SIZE_64 << 16;
}

uint32_t usb_memory_count(uint32_t ep)
{
    return (ENTRY(ep, 1) >> 16) & USB_COUNT_MASK;
}

static void set_count(uint32_t ep, uint32_t len)
{
    ENTRY(ep, 0) = TX_START(ep) | len << 16;
}

#else

typedef uint16_t unit_t;
#define STRIDE (CONFIG_MACH_STM32F1 ? 2u : 1u)
#define UNIT(ADDR) (*(volatile uint16_t *)(USB_PMA + STRIDE * (ADDR)))
#define ENTRY(EP, HALF) UNIT(8 * (EP) + 2 * (HALF))

void usb_memory_place(uint32_t ep)
{
    ENTRY(ep, 0) = (uint16_t)TX_START(ep);
    ENTRY(ep, 1) = 0;
    ENTRY(ep, 2) = (uint16_t)RX_START(ep);
    ENTRY(ep, 3) = (uint16_t)USB_RX_SIZE_64;
}

uint32_t usb_memory_count(uint32_t ep)
{
    return ENTRY(ep, 3) & USB_COUNT_MASK;
}

static void set_count(uint32_t ep, uint32_t len)
{
    ENTRY(ep, 1) = (uint16_t)len;
}

#endif

void usb_memory_read(uint32_t ep, uint8_t *data, uint32_t len)
{
    uint32_t addr = RX_START(ep), i, unit = 0;

    for (i = 0; i < len; i++) {
        if (i % sizeof(unit_t) == 0)
            unit = UNIT(addr + i);
        data[i] = (uint8_t)unit;
        unit >>= 8;
    }
}

void usb_memory_write(uint32_t ep, const uint8_t *data, uint32_t len)
{
    uint32_t addr = TX_START(ep), i, j, unit;

    for (i = 0; i < len; i += sizeof(unit_t)) {
        unit = 0;
        for (j = 0; j < sizeof(unit_t) && i + j < len; j++)
            unit |= (uint32_t)data[i + j] << (8 * j);
        UNIT(addr + i) = (unit_t)unit;
    }
    set_count(ep, len);
}
