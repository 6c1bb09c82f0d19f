/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A CAN bus bit by bit: wires, transceivers of the chip, and other nodes with
 * clocks of their own, which do what ISO 11898-1 says, or err on purpose.
 */
#ifndef UNICORN_CANWIRE_H
#define UNICORN_CANWIRE_H

#include <stdbool.h>
#include <stdint.h>

/* What the chip reads after one more of its cycles, in which it sends `tx`. */
bool wire_step(bool tx);
/* Nothing will happen unless the chip sends. */
bool wire_is_quiet(void);
void wire_skip(uint64_t cycles);
bool wire_exists(void);
uint32_t wire_rx_pin(void);
uint32_t wire_tx_pin(void);

#endif
