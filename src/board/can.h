/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: a CAN controller at CONFIG_CANBUS_FREQUENCY, on which
 * src/generic/can_serial.c is a console (src/Makefile adds it).
 *
 * The port declares DECL_CONSTANT_STR("RESERVE_PINS_CAN", "rx,tx").
 */
#ifndef BOARD_CAN_H
#define BOARD_CAN_H

#include <stdbool.h>
#include <stdint.h>
#include "port.h"

/* Flags of an id, as Linux has them */
#define CAN_EXTENDED 0x80000000u
#define CAN_REMOTE 0x40000000u

struct can_frame {
    uint32_t id;
    uint8_t len;                /* up to 8 */
    uint8_t data[8];
};

enum { CAN_STATE_ACTIVE = 0, CAN_STATE_WARN = 1, CAN_STATE_PASSIVE = 2,
       CAN_STATE_OFF = 3 };
struct can_status {
    uint32_t rx_error, tx_error, tx_retries;
    uint8_t state;
};

/* --- The port provides --- */

/* Task: send a frame behind those that wait; false: no room, can_note_tx()
 * comes when there is. */
bool can_send(const struct can_frame *frame);

/* Task: which ids are received, besides CAN_ID_ADMIN; all where
 * CONFIG_USBCANBUS is set. */
#define CAN_ID_ADMIN 0x3f0
void can_set_filter(uint16_t id);

/* Task: errors since the start, and how the controller takes part. */
void can_read_status(struct can_status *status);

/* --- The core provides --- */

/* Irq: a frame has arrived. */
void can_note_rx(const struct can_frame *frame);

/* Irq: a frame was sent. */
void can_note_tx(void);

#endif
