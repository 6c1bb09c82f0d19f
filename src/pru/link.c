/* SPDX-License-Identifier: GPL-3.0-or-later
 * PRU0: the link to the host.  It takes blocks apart with src/command.c, hands
 * commands to PRU1, and sends what that has to say. */
#include <setjmp.h>
#include <string.h>

#include "board/console.h"
#include "core/command.h"
#include "core/sched.h"
#include "core/tables.h"
#include "analog.h"
#include "lib/pru/am335x.h"
#include "mailbox.h"
#include "rpmsg.h"
#include "sched0.h"

DECL_CONSTANT("RECEIVE_WINDOW", 495);

#define BOX ((struct mailbox *)MAILBOX_FROM_PRU0)
enum { RX_SIZE = 192 };

static uint8_t rx_buf[RX_SIZE], rx_have;
static uint8_t tx_buf[RPMSG_MAX];
static uint16_t tx_have;
static jmp_buf main_loop;


/* ---- Console: bytes of the port ---- */

uint8_t console_peek(const uint8_t **data)
{
    *data = rx_buf;
    return rx_have;
}

void console_consume(uint8_t len)
{
    uint8_t i;

    rx_have = (uint8_t)(rx_have - len);
    for (i = 0; i < rx_have; i++)
        rx_buf[i] = rx_buf[i + len];
}

uint8_t *console_reserve(uint8_t len)
{
    return len <= RPMSG_MAX - tx_have ? tx_buf + tx_have : NULL;
}

void console_commit(uint8_t len)
{
    tx_have = (uint16_t)(tx_have + len);
}


/* ---- Messages of PRU1 ---- */

/* Encode the message at `raw` behind p; returns the new end. */
static uint8_t *encode(uint8_t *p, const uint8_t *raw)
{
    const ROM struct message_entry *entry = &tables_messages[*raw];
    uint16_t buffers = entry->buffers;
    uint8_t n = entry->n_params;
    uint32_t value;

    *p++ = *raw++;
    for (; n; n--, buffers >>= 1) {
        if (buffers & 1) {
            p = command_put_bytes(p, raw[0], raw + 1);
            raw += 1 + raw[0];
        } else {
            memcpy(&value, raw, sizeof(value));
            p = command_put_int(p, value);
            raw += sizeof(value);
        }
    }
    return p;
}

static void send_messages(void)
{
    uint8_t out = BOX->messages_out;

    while (BOX->messages_in != out) {
        uint8_t *start = command_begin(COMMAND_PAYLOAD_MAX);
        if (!start)
            break;
        mailbox_barrier();
        command_end(start, encode(
            start, BOX->messages[out % MAILBOX_MESSAGES].payload));
        mailbox_barrier();
        BOX->messages_out = ++out;
    }
    if (tx_have && rpmsg_write(tx_buf, tx_have))
        tx_have = 0;
}


/* ---- Commands for PRU1 ---- */

/* Room for one; waits until there is. */
static struct mailbox_command *begin_command(void)
{
    uint8_t in = BOX->commands_in;

    while ((uint8_t)(in - BOX->commands_out) >= MAILBOX_COMMANDS - 1)
        send_messages();
    return &BOX->commands[in % MAILBOX_COMMANDS];
}

static void end_command(struct mailbox_command *command, uint32_t id)
{
    command->id = id;
    mailbox_barrier();
    BOX->commands_in++;
}

/* Byte strings move along; args say where PRU1 finds them. */
static void move_bytes(struct mailbox_command *command,
                       const ROM struct command_entry *entry)
{
    uint16_t buffers = entry->buffers;
    command_slot_t *slot = command->args;
    uint8_t *pos = command->bytes;

    for (; buffers; buffers >>= 1, slot++) {
        if (!(buffers & 1))
            continue;
        memcpy(pos, (const void *)slot[1], slot[0]);
        slot[1] = (uint32_t)pos - MAILBOX_FROM_PRU0 + MAILBOX_ADDR;
        pos += slot[0];
        slot++;
    }
}

const uint8_t *command_run(const uint8_t *p, const uint8_t *end)
{
    struct mailbox_command *command = begin_command();
    const ROM struct command_entry *entry;
    uint32_t id;

    if (!command_get_int(&p, end, &id))
        shutdown("Command parser error");
    if (id >= tables_command_count || !tables_commands[id].flags)
        shutdown("Invalid command");
    entry = &tables_commands[id];
    p = command_parse_args(p, end, entry, command->args);
    if (entry->handler) {
        entry->handler(command->args);
        return p;
    }
    move_bytes(command, entry);
    end_command(command, id);
    return p;
}

/* What this core cannot make sense of stops the other one. */
void sched_shutdown(uint16_t reason)
{
    struct mailbox_command *command = begin_command();

    command->args[0] = reason;
    end_command(command, MAILBOX_SHUTDOWN);
    longjmp(main_loop, 1);
}


/* ---- Start ---- */

static void enable_clock(volatile uint32_t *clock)
{
    *clock = (*clock & ~CM_MODULE_MASK) | CM_MODULE_ENABLE;
    while (*clock & CM_IDLE_MASK)
        ;
}

/* PRU1 waits for this. */
static void start_pins(void)
{
    enable_clock(&CM_GPIO0);
    enable_clock(&CM_GPIO1);
    enable_clock(&CM_GPIO2);
    enable_clock(&CM_GPIO3);
}

/* It counts once a cycle, and wraps by itself. */
static void start_clock(void)
{
    IEP_GLOBAL_CFG = 0;
    IEP_COUNT = 0;
    IEP_GLOBAL_CFG = IEP_CFG_ENABLE | IEP_CFG_STEP(1);
}

static void take_bytes(void)
{
    uint32_t got = rpmsg_read(rx_buf + rx_have, (uint32_t)RX_SIZE - rx_have);

    if (!got)
        return;
    rx_have = (uint8_t)(rx_have + got);
    console_note_rx();
}

int main(void)
{
    PRUCFG_SYSCFG &= ~SYSCFG_STANDBY_INIT;
    start_pins();
    start_clock();
    BOX->analog_wanted = 0;
    BOX->commands_in = BOX->commands_out = 0;
    BOX->messages_in = BOX->messages_out = 0;
    BOX->link_ready = MAILBOX_READY;
    while (BOX->exec_ready != MAILBOX_READY)
        ;
    BOX->exec_ready = 0;
    rpmsg_open();
    tables_run_inits();
    if (setjmp(main_loop))
        command_shutdown();
    for (;;) {
        take_bytes();
        tables_run_tasks();
        send_messages();
        analog_poll(BOX);
        sched0_run_timer();
        sched0_note(rx_have || BOX->commands_in != BOX->commands_out);
    }
}
