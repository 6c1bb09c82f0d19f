/* SPDX-License-Identifier: GPL-3.0-or-later
 * Between the cores: commands go to PRU1, which runs the firmware; messages go
 * to PRU0, which talks with the host.
 *
 * It lies in PRU1's memory.  Indices count up forever, modulo 256; each is
 * written by one core only, after what it announces (the cores' stores and
 * loads happen in order).
 */
#ifndef PRU_MAILBOX_H
#define PRU_MAILBOX_H

#include <stdint.h>
#include "core/command.h"

enum { MAILBOX_COMMANDS = 4, MAILBOX_MESSAGES = 16, MAILBOX_ANALOG = 8,
       MAILBOX_PAYLOAD_MAX = COMMAND_PAYLOAD_MAX + 5 };
#define MAILBOX_READY 0x6b6c6970u
#define MAILBOX_NO_READING 0xffffu
/* Numbers beside those of commands: what PRU0 could not make sense of */
#define MAILBOX_SHUTDOWN 0xffffu

/* Its size makes it quick to find. */
struct mailbox_command {
    uint32_t id;                /* or MAILBOX_SHUTDOWN, args[0] is the reason */
    command_slot_t args[TABLES_MAX_SLOTS];
    uint8_t bytes[COMMAND_PAYLOAD_MAX + 1]; /* byte strings of the args */
} __attribute__((aligned(128)));

/* Between looking at an index and at what it announces, in either order. */
static inline void mailbox_barrier(void)
{
    __asm__ volatile("" ::: "memory");
}

/* Number of the message, then its parameters as they are: words, and bytes
 * behind their count.  PRU0 encodes them. */
struct mailbox_message {
    uint8_t payload[MAILBOX_PAYLOAD_MAX];
};

struct mailbox {
    /* MAILBOX_READY: clocks of pins are on; PRU1 looks at what follows.  Each
     * core waits for the other's and takes it away. */
    volatile uint32_t link_ready, exec_ready;
    /* PRU0 writes what it has read, PRU1 MAILBOX_NO_READING when it has taken
     * it: what no longer comes cannot be taken for a temperature. */
    volatile uint16_t analog[MAILBOX_ANALOG];
    volatile uint8_t analog_wanted;
    volatile uint8_t commands_in, commands_out;
    volatile uint8_t messages_in, messages_out;
    /* One is always free: that of the command which runs. */
    struct mailbox_command commands[MAILBOX_COMMANDS];
    /* One is always free; it takes what there is no room for, too. */
    struct mailbox_message messages[MAILBOX_MESSAGES];
};

/* Where PRU1 sees it, as addresses in it mean, and where PRU0 does. */
#define MAILBOX_ADDR 0x1900u
#define MAILBOX_SIZE (0x2000u - MAILBOX_ADDR)
#define MAILBOX_FROM_PRU0 (0x2000u + MAILBOX_ADDR)

#endif
