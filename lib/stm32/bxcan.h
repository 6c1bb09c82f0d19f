/* SPDX-License-Identifier: GPL-3.0-or-later
 * bxCAN: RM0008, 24.9; RM0091, 29.9; RM0090, 32.9.
 */
#ifndef STM32_BXCAN_H
#define STM32_BXCAN_H

#include <stdint.h>

/* A frame that is sent, or has come */
struct bxcan_mailbox {
    volatile uint32_t IR, DTR, DLR, DHR;
};
struct bxcan_regs {
    volatile uint32_t MCR, MSR, TSR, RFR[2], IER, ESR, BTR, reserved0[88];
    struct bxcan_mailbox TX[3], RX[2];
    volatile uint32_t reserved1[12], FMR, FM1R, reserved2, FS1R, reserved3;
    volatile uint32_t FFA1R, reserved4, FA1R, reserved5[8], FR[28][2];
};
#define BXCAN_MCR_INRQ (1u << 0)
#define BXCAN_MCR_TXFP (1u << 2)        /* in the order of requests */
#define BXCAN_MCR_ABOM (1u << 6)        /* back from bus off by itself */
#define BXCAN_MSR_INAK (1u << 0)
#define BXCAN_MSR_ERRI (1u << 2)
#define BXCAN_TSR_DONE (1u << 0 | 1u << 8 | 1u << 16)
#define BXCAN_TSR_EMPTY(I) (1u << (26 + (I)))
#define BXCAN_RFR_COUNT 3u
#define BXCAN_RFR_RELEASE (1u << 5)
#define BXCAN_IER_TX (1u << 0)
#define BXCAN_IER_RX0 (1u << 1)
#define BXCAN_IER_LAST_ERROR (1u << 11)
#define BXCAN_IER_ERROR (1u << 15)
#define BXCAN_ESR_WARNING (1u << 0)
#define BXCAN_ESR_PASSIVE (1u << 1)
#define BXCAN_ESR_OFF (1u << 2)
#define BXCAN_ESR_LAST(E) (((E) >> 4) & 7u)
#define BXCAN_ESR_NO_ERROR (7u << 4)    /* what software may set */
#define BXCAN_BTR(PRESCALER, SEG1, SEG2) \
    (((PRESCALER) - 1u) | ((SEG1) - 1u) << 16 | ((SEG2) - 1u) << 20)
#define BXCAN_IR_SEND (1u << 0)
#define BXCAN_IR_REMOTE (1u << 1)
#define BXCAN_IR_EXTENDED (1u << 2)
#define BXCAN_IR_STANDARD_SHIFT 21
#define BXCAN_IR_EXTENDED_SHIFT 3
#define BXCAN_FMR_INIT (1u << 0)

#endif
