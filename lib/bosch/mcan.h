/* SPDX-License-Identifier: GPL-3.0-or-later
 * M_CAN, the CAN controller of Bosch (M_CAN user's manual, 2.3 and 2.4), which
 * is MCAN of SAM E70 (DS60001527, 49.6), CAN of SAM C21 and E5x (DS60001479,
 * 34.8; DS60001507, 39.8) and FDCAN of STM32: RM0433, 59.5 (H7); RM0444, 36.4
 * (G0B1) and RM0440, 44.4 (G4), where the message memory is divided once for
 * all and registers lie elsewhere.
 */
#ifndef BOSCH_MCAN_H
#define BOSCH_MCAN_H

#include <stdint.h>

#if !CONFIG_HAVE_MCAN_FIXED_MEMORY
struct mcan_regs {
    volatile uint32_t CREL, ENDN, reserved0, DBTP, TEST, RWD, CCCR, NBTP;
    volatile uint32_t TSCC, TSCV, TOCC, TOCV, reserved1[4], ECR, PSR, TDCR;
    volatile uint32_t reserved2, IR, IE, ILS, ILE, reserved3[8], GFC, SIDFC;
    volatile uint32_t XIDFC, reserved4, XIDAM, HPMS, NDAT1, NDAT2, RXF0C;
    volatile uint32_t RXF0S, RXF0A, RXBC, RXF1C, RXF1S, RXF1A, RXESC, TXBC;
    volatile uint32_t TXFQS, TXESC, TXBRP, TXBAR, TXBCR, TXBTO, TXBCF, TXBTIE;
};
#define MCAN_INT_SENT (1u << 9)
#define MCAN_INT_OFF (1u << 25)
#define MCAN_INT_PROTOCOL (1u << 27)
/* Where a part of the memory begins, in bytes, and its elements */
#define MCAN_SIDFC(START, COUNT) ((START) | (uint32_t)(COUNT) << 16)
#define MCAN_RXF0C(START, COUNT) ((START) | (uint32_t)(COUNT) << 16)
#define MCAN_TXBC(START, COUNT) ((START) | (uint32_t)(COUNT) << 24)
#define MCAN_GET_INDEX(S) (((S) >> 8) & 63u)
#define MCAN_RX_LEVEL(S) ((S) & 127u)
#define MCAN_PUT_INDEX(S) (((S) >> 16) & 31u)
#else
struct mcan_regs {
    volatile uint32_t CREL, ENDN, reserved0, DBTP, TEST, RWD, CCCR, NBTP;
    volatile uint32_t TSCC, TSCV, TOCC, TOCV, reserved1[4], ECR, PSR, TDCR;
    volatile uint32_t reserved2, IR, IE, ILS, ILE, reserved3[8], RXGFC;
    volatile uint32_t XIDAM, HPMS, reserved4, RXF0S, RXF0A, RXF1S, RXF1A;
    volatile uint32_t reserved5[8], TXBC, TXFQS, TXBRP, TXBAR, TXBCR, TXBTO;
    volatile uint32_t TXBCF, TXBTIE;
};
#define MCAN_INT_SENT (1u << 7)
#define MCAN_INT_OFF (1u << 19)
#define MCAN_INT_PROTOCOL (1u << 21)
#define MCAN_RXGFC_STANDARD_FILTERS(N) ((uint32_t)(N) << 16)
#define MCAN_GET_INDEX(S) (((S) >> 8) & 3u)
#define MCAN_RX_LEVEL(S) ((S) & 15u)
#define MCAN_PUT_INDEX(S) (((S) >> 16) & 3u)
#endif

#define MCAN_CCCR_INIT (1u << 0)
#define MCAN_CCCR_CCE (1u << 1)
#define MCAN_NBTP(PRESCALER, SEG1, SEG2) \
    (((SEG2) - 1u) | ((SEG1) - 1u) << 8 | ((PRESCALER) - 1u) << 16)
#define MCAN_PSR_LAST(P) ((P) & 7u)
#define MCAN_PSR_PASSIVE (1u << 5)
#define MCAN_PSR_WARNING (1u << 6)
#define MCAN_PSR_OFF (1u << 7)
#define MCAN_INT_RX0 (1u << 0)
#define MCAN_ILE_LINE0 (1u << 0)
#define MCAN_TXFQS_FULL (1u << 21)
/* GFC and RXGFC: remote frames and those without a filter are rejected */
#define MCAN_FILTER_STRICT (3u << 0 | 2u << 2 | 2u << 4)
/* they all go to fifo 0 */
#define MCAN_FILTER_ALL 0u

/* Elements of the message memory */
#define MCAN_FILTER_IDS(A, B) \
    (1u << 30 | 1u << 27 | (uint32_t)(A) << 16 | (uint32_t)(B))
#define MCAN_ELEMENT_EXTENDED (1u << 30)
#define MCAN_ELEMENT_REMOTE (1u << 29)
#define MCAN_ELEMENT_LENGTH(W) (((W) >> 16) & 15u)
struct mcan_element {
    volatile uint32_t id, control, data[2];
};

#endif
