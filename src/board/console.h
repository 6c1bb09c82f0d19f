/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: the byte stream to the host.
 *
 * The port declares DECL_CONSTANT("RECEIVE_WINDOW", <size of its rx buffer>)
 * and, on a serial line, DECL_CONSTANT("SERIAL_BAUD", ...) and the pins as
 * DECL_CONSTANT_STR("RESERVE_PINS_serial", "rx,tx").
 */
#ifndef BOARD_CONSOLE_H
#define BOARD_CONSOLE_H

#include <stdint.h>
#include "port.h"

/* Largest block of the wire protocol; an rx buffer holds three or more. */
#define CONSOLE_BLOCK_MAX 64

/* --- The port provides --- */

/* Task: the bytes received and not yet consumed, contiguous at *data.  They
 * stay there until console_consume().  Returns how many; never blocks. */
uint8_t console_peek(const uint8_t **data);

/* Task: drop the first `len` of these bytes. */
void console_consume(uint8_t len);

/* Task, or irqs off during shutdown: room for up to `len` bytes of output, or
 * NULL if the buffer is full.  Never blocks. */
uint8_t *console_reserve(uint8_t len);

/* After console_reserve(): send the first `len` bytes of the room (may be
 * fewer than reserved).  Returns before they are sent. */
void console_commit(uint8_t len);

/* --- The core provides --- */

/* Any context: bytes have arrived; the command task will peek at them. */
void console_note_rx(void);

#endif
