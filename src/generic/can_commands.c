/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a host may ask about the CAN bus. */
#include "board/can.h"
#include "core/command.h"
#include "core/sched.h"
#include "generic/can_node.h"
#include "generic/can_uuid.h"

DECL_ENUMERATION("canbus_bus_state", "active", 0);
DECL_ENUMERATION("canbus_bus_state", "warn", 1);
DECL_ENUMERATION("canbus_bus_state", "passive", 2);
DECL_ENUMERATION("canbus_bus_state", "off", 3);

void command_get_canbus_status(const struct args_get_canbus_status *args)
{
    struct can_status status;

    (void)args;
    can_read_status(&status);
    sendf("canbus_status rx_error=%u tx_error=%u tx_retries=%u"
          " canbus_bus_state=%u", status.rx_error, status.tx_error,
          status.tx_retries, status.state);
}
DECL_COMMAND_FLAGS(command_get_canbus_status, COMMAND_IN_SHUTDOWN,
                   "get_canbus_status");

void command_get_canbus_id(const struct args_get_canbus_id *args)
{
    (void)args;
    sendf("canbus_id canbus_uuid=%.*s canbus_nodeid=%u", CAN_UUID_SIZE,
          can_uuid_get(), can_node_get_id());
}
DECL_COMMAND_FLAGS(command_get_canbus_id, COMMAND_IN_SHUTDOWN,
                   "get_canbus_id");
