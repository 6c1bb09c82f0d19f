/* SPDX-License-Identifier: GPL-3.0-or-later
 * Commands as a host writes them. */
#include "core/tables.h"
#include "send_command.h"
#include "tests.h"

/* The number of a command is where its handler stands in the table. */
uint32_t find_command(void *handler)
{
    uint32_t id = 0;

    while (id < tables_command_count
           && (void *)tables_commands[id].handler != handler)
        id++;
    CHECK(id < tables_command_count);
    return id;
}

uint8_t put_command(uint8_t payload[COMMAND_PAYLOAD_MAX], void *handler, int n,
                    const uint32_t *values)
{
    uint8_t *p = command_put_int(payload, find_command(handler));

    for (int i = 0; i < n; i++)
        p = command_put_int(p, values[i]);
    return (uint8_t)(p - payload);
}
