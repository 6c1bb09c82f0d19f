/* SPDX-License-Identifier: GPL-3.0-or-later
 * From a message to the function that handles it. */
#include "core/command.h"
#include "core/sched.h"
#include "core/tables.h"

const uint8_t *command_run(const uint8_t *p, const uint8_t *end)
{
    command_slot_t args[TABLES_MAX_SLOTS];
    const ROM struct command_entry *entry;
    uint32_t id;

    if (!command_get_int(&p, end, &id))
        shutdown("Command parser error");
    if (id >= tables_command_count || !tables_commands[id].handler)
        shutdown("Invalid command");
    entry = &tables_commands[id];
    p = command_parse_args(p, end, entry, args);
    if (sched_is_shutdown() && !(entry->flags & COMMAND_IN_SHUTDOWN))
        sched_report_shutdown();
    else
        entry->handler(args);
    return p;
}
