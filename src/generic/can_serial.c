/* SPDX-License-Identifier: GPL-3.0-or-later
 * A node alone on its controller. */
#include "core/sched.h"
#include "generic/can_node.h"

DECL_CONSTANT("CANBUS_FREQUENCY", CONFIG_CANBUS_FREQUENCY);

void can_note_rx(const struct can_frame *frame)
{
    can_node_take(frame);
}

void can_note_tx(void)
{
    can_node_note_room();
}

bool can_node_send(const struct can_frame *frame)
{
    return can_send(frame);
}

void can_node_set_filter(uint16_t id)
{
    can_set_filter(id);
}
