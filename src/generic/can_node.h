/* SPDX-License-Identifier: GPL-3.0-or-later
 * A node of the console's protocol on CAN: frames in, frames out.
 */
#ifndef GENERIC_CAN_NODE_H
#define GENERIC_CAN_NODE_H

#include "board/can.h"

/* Irq: a frame that may concern this node. */
void can_node_take(const struct can_frame *frame);
/* Any context: a frame that had no room may have some now. */
void can_node_note_room(void);
/* Task: number of the node, 0 without. */
uint8_t can_node_get_id(void);

/* Of the bus, or of the bridge that the node is part of: as can_send(). */
bool can_node_send(const struct can_frame *frame);
void can_node_set_filter(uint16_t id);

#endif
