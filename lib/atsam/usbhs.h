/* SPDX-License-Identifier: GPL-3.0-or-later
 * USB controller of SAM3X (UOTGHS: 11057, 39.6) and SAM E70 (USBHS: DS60001527,
 * 39.6), as a device.
 */
#ifndef ATSAM_USBHS_H
#define ATSAM_USBHS_H

#include "atsam/periph.h"

struct usbhs_regs {
    volatile uint32_t DEVCTRL, DEVISR, DEVICR, DEVIFR, DEVIMR, DEVIDR, DEVIER;
    volatile uint32_t DEVEPT, DEVFNUM, reserved0[55];
    volatile uint32_t DEVEPTCFG[10], reserved1[2], DEVEPTISR[10], reserved2[2];
    volatile uint32_t DEVEPTICR[10], reserved3[2], DEVEPTIFR[10], reserved4[2];
    volatile uint32_t DEVEPTIMR[10], reserved5[2], DEVEPTIER[10], reserved6[2];
    volatile uint32_t DEVEPTIDR[10], reserved7[366], CTRL, SR;
};
#define USBHS_DEVCTRL_ADDEN (1u << 7)
#define USBHS_DEVCTRL_DETACH (1u << 8)
#define USBHS_DEVCTRL_FULL_SPEED (3u << 10)
#define USBHS_INT_EORST (1u << 3)
#define USBHS_INT_ENDPOINT(N) (1u << (12 + (N)))
#define USBHS_INT_ENDPOINTS (0x3ffu << 12)
#define USBHS_CFG_ALLOC (1u << 1)
#define USBHS_CFG_TWO_BANKS (1u << 2)
#define USBHS_CFG_SIZE_8 (0u << 4)
#define USBHS_CFG_SIZE_64 (3u << 4)
#define USBHS_CFG_IN (1u << 8)
#define USBHS_CFG_BULK (2u << 11)
#define USBHS_CFG_INTERRUPT (3u << 11)
#define USBHS_EPT_TXIN (1u << 0)
#define USBHS_EPT_RXOUT (1u << 1)
#define USBHS_EPT_RXSTP (1u << 2)
#define USBHS_EPT_COUNT(ISR) ((ISR) >> 20 & 0x7ff)
#define USBHS_EPT_FIFOCON (1u << 14)
#define USBHS_EPT_STALLRQ (1u << 19)
#define USBHS_CTRL_OTGPADE (1u << 12)   /* SAM3X */
#define USBHS_CTRL_USBE (1u << 15)
#define USBHS_CTRL_UIMOD_DEVICE (1u << 25)
#define USBHS_SR_CLKUSABLE (1u << 14)

/* Bytes of an endpoint's buffer: any address of its 32 KiB */
#define USBHS_FIFO(EP) ((volatile uint8_t *)(USBHS_MEMORY + 0x8000 * (EP)))

/* 11057, 28.15: the PLL of 480 MHz, and USB's clock of 48 */
#define PMC_UCKR_UPLLEN (1u << 16)
#define PMC_UCKR_COUNT(N) ((N) << 20)
#define PMC_SR_LOCKU (1u << 6)
#define PMC_USB_UPLL_10 (1u | 9u << 8)
#define PMC_SCER_USB (1u << 5)

#endif
