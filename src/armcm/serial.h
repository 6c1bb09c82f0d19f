/* SPDX-License-Identifier: GPL-3.0-or-later
 * The console on a serial line: buffers here, registers in the port.
 */
#ifndef ARMCM_SERIAL_H
#define ARMCM_SERIAL_H

#include <stdbool.h>
#include <stdint.h>

/* Irq: a byte has arrived. */
void serial_note_byte(uint8_t data);

/* Irq: the next byte to send; false when there is none. */
bool serial_next_byte(uint8_t *data);

/* The port's, any context: interrupt as long as a byte can be sent. */
void serial_start_tx(void);

#endif
