/* SPDX-License-Identifier: GPL-3.0-or-later
 * The wire protocol: blocks in, messages out.
 *
 * Generated senders use command_begin(), command_put_*() and command_end();
 * other code writes sendf().  Blocks are the matter of command.c, messages that
 * of core/message.c, who gets them that of core/dispatch.c.
 */
#ifndef CORE_COMMAND_H
#define CORE_COMMAND_H

#include <stdint.h>
#include "board/mem.h"
#include "core/decl.h"

#define COMMAND_BLOCK_MIN 5
#define COMMAND_BLOCK_MAX 64
#define COMMAND_PAYLOAD_MAX (COMMAND_BLOCK_MAX - COMMAND_BLOCK_MIN)
#define COMMAND_SYNC 0x7e
#define COMMAND_DEST 0x10
#define COMMAND_SEQ_MASK 0x0f

/* One parameter's place in an args struct: fits an integer or a pointer. */
#if UINTPTR_MAX > 0xffffffffu
typedef uint64_t command_slot_t;
#else
typedef uint32_t command_slot_t;
#endif
#define COMMAND_ARG __attribute__((aligned(sizeof(command_slot_t))))

/* Room for a message of up to `size` payload bytes: where it starts, or NULL
 * when the console is full. */
uint8_t *command_begin(uint8_t size);

/* Append to a message; each returns the new end. */
uint8_t *command_put_int(uint8_t *p, uint32_t value);
uint8_t *command_put_bytes(uint8_t *p, uint8_t len, const uint8_t *data);
uint8_t *command_put_rom(uint8_t *p, uint8_t len, const ROM uint8_t *data);

/* Frame and send the message that lies between `start` and `end`. */
void command_end(uint8_t *start, uint8_t *end);

/* Read an integer from [*p, end); false if it is cut short or too long. */
int command_get_int(const uint8_t **p, const uint8_t *end, uint32_t *value);

/* Fill in one args struct; returns where the message ends.  A message that ends
 * too early is a shutdown. */
struct command_entry;
const uint8_t *command_parse_args(const uint8_t *p, const uint8_t *end,
                                  const ROM struct command_entry *entry,
                                  command_slot_t *slot);

/* Run the message at p; returns where it ends. */
const uint8_t *command_run(const uint8_t *p, const uint8_t *end);

#endif
