/* SPDX-License-Identifier: GPL-3.0-or-later
 * USB device port of SAM4S and SAM4E: 11100, 40.7 (UDP), 29.17.13 (its clock).
 */
#ifndef ATSAM_UDP_H
#define ATSAM_UDP_H

#include "atsam/periph.h"

struct udp_regs {
    volatile uint32_t FRM_NUM, GLB_STAT, FADDR, reserved0, IER, IDR, IMR, ISR;
    volatile uint32_t ICR, reserved1, RST_EP, reserved2, CSR[8], FDR[8];
    volatile uint32_t reserved3, TXVC;
};
#define UDP_GLB_ADDRESSED 1u
#define UDP_GLB_CONFIGURED 2u
#define UDP_FADDR_FEN (1u << 8)
#define UDP_INT_BUS_RESET (1u << 12)
#define UDP_CSR_TXCOMP (1u << 0)
#define UDP_CSR_RX_BK0 (1u << 1)
#define UDP_CSR_RXSETUP (1u << 2)
#define UDP_CSR_STALLSENT (1u << 3)
#define UDP_CSR_TXPKTRDY (1u << 4)
#define UDP_CSR_FORCESTALL (1u << 5)
#define UDP_CSR_RX_BK1 (1u << 6)
#define UDP_CSR_DIR_IN (1u << 7)
#define UDP_CSR_BULK_OUT (2u << 8)
#define UDP_CSR_BULK_IN (6u << 8)
#define UDP_CSR_INTERRUPT_IN (7u << 8)
#define UDP_CSR_EPEDS (1u << 15)
#define UDP_CSR_COUNT(CSR) ((CSR) >> 16 & 0x7ff)
/* Flags that a zero clears and a one leaves as they are */
#define UDP_CSR_FLAGS (UDP_CSR_TXCOMP | UDP_CSR_RX_BK0 | UDP_CSR_RXSETUP \
                       | UDP_CSR_STALLSENT | UDP_CSR_RX_BK1)
#define UDP_TXVC_PUON (1u << 9)

/* 29.17: a fifth of PLLA; the clock of the port */
#define PMC_USB_PLLA_5 (4u << 8)
#define PMC_SCER_UDP (1u << 7)

#endif
