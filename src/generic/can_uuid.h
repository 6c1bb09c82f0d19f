/* SPDX-License-Identifier: GPL-3.0-or-later
 * Who a node of a CAN bus is, before it has a number. */
#ifndef GENERIC_CAN_UUID_H
#define GENERIC_CAN_UUID_H

#include <stdint.h>

enum { CAN_UUID_SIZE = 6 };

/* Task: made of the chip's id; stays where it is. */
const uint8_t *can_uuid_get(void);

#endif
