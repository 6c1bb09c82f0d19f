/* SPDX-License-Identifier: GPL-3.0-or-later
 * PRU1: runs commands that PRU0 has taken apart, hands it messages to send. */
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "board/irq.h"
#include "core/command.h"
#include "core/sched.h"
#include "core/tables.h"
#include "exec.h"

static struct task_wake exec_wake; /* only keeps the main loop awake */

_Static_assert(TABLES_MAX_ID < 96, "a message's number is one byte");
_Static_assert(sizeof(struct mailbox) <= MAILBOX_SIZE, "behind the stack");


/* ---- Messages ---- */

uint8_t *command_begin(uint8_t size)
{
    uint8_t in = BOX->messages_in;

    if (size > COMMAND_PAYLOAD_MAX)
        shutdown("Message encode error");
    return BOX->messages[in % MAILBOX_MESSAGES].payload;
}

uint8_t *command_put_bytes(uint8_t *p, uint8_t len, const uint8_t *data)
{
    *p++ = len;
    memcpy(p, data, len);
    return p + len;
}

void command_end(uint8_t *start, uint8_t *end)
{
    (void)start;
    (void)end;
    mailbox_barrier();
    if ((uint8_t)(BOX->messages_in - BOX->messages_out) < MAILBOX_MESSAGES - 1)
        BOX->messages_in++;
}


/* ---- Commands ---- */

void exec_poll(void)
{
    if (BOX->commands_in != BOX->commands_out)
        sched_wake(&exec_wake);
}

static void run_command(const struct mailbox_command *command)
{
    const ROM struct command_entry *entry;

    if (command->id == MAILBOX_SHUTDOWN)
        sched_shutdown((uint16_t)command->args[0]);
    entry = &tables_commands[command->id];
    if (sched_is_shutdown() && !(entry->flags & COMMAND_IN_SHUTDOWN))
        sched_report_shutdown();
    else
        entry->handler(command->args);
}

/* Elsewhere the task of src/command.c.  The place of a command is not used
 * again while the command runs, though it counts as done: it may shut down. */
void exec_task(void)
{
    uint8_t out = BOX->commands_out;

    if (BOX->commands_in == out)
        return;
    mailbox_barrier();
    BOX->commands_out = (uint8_t)(out + 1);
    run_command(&BOX->commands[out % MAILBOX_COMMANDS]);
}
DECL_TASK(exec_task);

int main(void)
{
    while (BOX->link_ready != MAILBOX_READY)
        ;
    BOX->link_ready = 0;
    BOX->exec_ready = MAILBOX_READY;
    sched_main();
}
