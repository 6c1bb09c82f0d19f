/* SPDX-License-Identifier: GPL-3.0-or-later
 * Commands for people who debug the firmware or the link. */
#include "board/mem.h"
#include "core/command.h"
#include "core/sched.h"

void command_debug_read(const struct args_debug_read *args)
{
    sendf("debug_result val=%u", mem_debug_read(args->order, args->addr));
}
DECL_COMMAND_FLAGS(command_debug_read, COMMAND_IN_SHUTDOWN,
                   "debug_read order=%c addr=%u");

void command_debug_write(const struct args_debug_write *args)
{
    mem_debug_write(args->order, args->addr, args->val);
}
DECL_COMMAND_FLAGS(command_debug_write, COMMAND_IN_SHUTDOWN,
                   "debug_write order=%c addr=%u val=%u");

void command_debug_ping(const struct args_debug_ping *args)
{
    sendf("pong data=%*s", args->data_len, args->data);
}
DECL_COMMAND_FLAGS(command_debug_ping, COMMAND_IN_SHUTDOWN,
                   "debug_ping data=%*s");

void command_debug_nop(const struct args_debug_nop *args)
{
    (void)args;
}
DECL_COMMAND_FLAGS(command_debug_nop, COMMAND_IN_SHUTDOWN, "debug_nop");
