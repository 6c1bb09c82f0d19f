/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the two halves of can_bits.h share: rings of frames, and counts.
 *
 * Each number is written by one core only, after what it stands for.
 */
#ifndef GENERIC_CAN_BITS_RINGS_H
#define GENERIC_CAN_BITS_RINGS_H

#include "generic/can_bits.h"

enum { CRC_POLYNOMIAL = 0x4599, PASSIVE_AT = 128, WARN_AT = 96, OFF_AT = 256 };
enum { RX_COUNT = 16, TX_COUNT = 4 };
/* Bits of a frame with their stuffing, delimiter included: 118 that may get one
 * in four */
enum { MAX_BITS = 118 + 29 + 1 };

/* A bit to send.  Words are those for the bit that follows, while a node is
 * active, and while it is passive. */
#define BIT_LEVEL 1u
#define BIT_ACTIVE_SHIFT 1
#define BIT_PASSIVE_SHIFT 4
#define BIT_MAY_LOSE 0x80u

struct tx_slot { uint8_t bits[MAX_BITS + 1]; }; /* 0 ends them */
/* The fields of a frame as they came */
struct rx_slot { uint32_t head, extension, len, is_remote, data[2]; };

/* (numbers first: near ones are read faster) */
extern struct can_bits_rings {
    volatile uint32_t tx_put, tx_got, rx_put, rx_got, filter_id;
    /* the slot behind those that wait is being filled */
    struct rx_slot rx[RX_COUNT];
    struct tx_slot tx[TX_COUNT];
} can_bits__rings;

extern volatile struct can_bits_counts {
    uint32_t rx_error, tx_error, retries, rec, tec;
    bool is_off;
} can_bits__counts;

#endif
