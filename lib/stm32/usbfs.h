/* SPDX-License-Identifier: GPL-3.0-or-later
 * The full-speed USB device: RM0008, 23.5 (F103); RM0091, 30.6 (F0); RM0394,
 * 43.6 (L4); RM0440, 45.6 (G4); RM0444, 37.6 (G0B1, whose packet memory is
 * described in words).  CRS: RM0091, 7.6; RM0433, 9.7 (H7).
 */
#ifndef STM32_USBFS_H
#define STM32_USBFS_H

#include <stdint.h>

struct usbfs_regs {
    volatile uint32_t EPR[8], reserved0[8], CNTR, ISTR, FNR, DADDR, BTABLE;
    volatile uint32_t LPMCSR, BCDR;
};

/* Endpoints.  Flags CTR are cleared by zeros; STAT and DTOG invert by ones. */
#define USB_EPR_EA 0xfu
#define USB_EPR_STAT_TX (3u << 4)
#define USB_EPR_DTOG_TX (1u << 6)
#define USB_EPR_CTR_TX (1u << 7)
#define USB_EPR_KIND (1u << 8)
#define USB_EPR_TYPE (3u << 9)
#define USB_EPR_BULK (0u << 9)
#define USB_EPR_CONTROL (1u << 9)
#define USB_EPR_INTERRUPT (3u << 9)
#define USB_EPR_SETUP (1u << 11)
#define USB_EPR_STAT_RX (3u << 12)
#define USB_EPR_DTOG_RX (1u << 14)
#define USB_EPR_CTR_RX (1u << 15)
#define USB_STAT_DISABLED 0u
#define USB_STAT_STALL 1u
#define USB_STAT_NAK 2u
#define USB_STAT_VALID 3u
#define USB_STAT_TX(S) ((S) << 4)
#define USB_STAT_RX(S) ((S) << 12)

#define USB_CNTR_FRES (1u << 0)
#define USB_CNTR_PDWN (1u << 1)
#define USB_CNTR_RESETM (1u << 10)
#define USB_CNTR_CTRM (1u << 15)
#define USB_ISTR_EP_ID 0xfu
#define USB_ISTR_DIR (1u << 4)
#define USB_ISTR_RESET (1u << 10)
#define USB_ISTR_CTR (1u << 15)
#define USB_DADDR_EF (1u << 7)
#define USB_BCDR_DPPU (1u << 15)    /* not on F103 */

/* Sizes of reception buffers, in the field of COUNT_RX */
#define USB_RX_SIZE_16 (8u << 10)
#define USB_RX_SIZE_64 (1u << 15 | 1u << 10)
#define USB_COUNT_MASK 0x3ffu

/* Clock recovery: its reset values suit 48 MHz and the host's frames. */
struct crs_regs {
    volatile uint32_t CR, CFGR, ISR, ICR;
};
#define CRS_CR_CEN (1u << 5)
#define CRS_CR_AUTOTRIMEN (1u << 6)
#define CRS_CFGR_SYNCSRC (3u << 28)
#define CRS_CFGR_SYNC_USB (2u << 28)
#define CRS_CFGR_SYNC_USB2 (3u << 28)   /* H7 */

#endif
