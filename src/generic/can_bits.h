/* SPDX-License-Identifier: GPL-3.0-or-later
 * A CAN 2.0B controller bit by bit, for chips that have none: the protocol, for
 * something that samples and drives the bus (docs/internals/firmware_can.md).
 *
 * One core calls can_bits_*() of the first part, another those of the second.
 * Frames go between them through rings; neither waits for the other.
 */
#ifndef GENERIC_CAN_BITS_H
#define GENERIC_CAN_BITS_H

#include "board/can.h"

/* What to do in the bit after the next, by how that next one is sampled:
 * levels (1: recessive); and whether bits go on after a recessive one, or a
 * dominant edge is waited for. */
#define CAN_WORD(IF_RECESSIVE, IF_DOMINANT) \
    ((uint32_t)(IF_RECESSIVE) | 2u | (uint32_t)(IF_DOMINANT) << 2)
#define CAN_WORD_REST CAN_WORD(1, 1)
#define CAN_WORD_IDLE 5u

/* --- The core of the bus --- */

/* A bit was sampled; returns the word for the bit after the next.  Words begin
 * with CAN_WORD_REST for the second. */
uint32_t can_bits_take(uint32_t level);
/* What could wait until the word was passed on; before the next bit.  Is the
 * next sample that of a frame's first bit, whenever it comes? */
bool can_bits_settle(void);
/* The bus rests, as CAN_WORD_IDLE wanted: is there a frame?  Then a dominant
 * bit is to be sent now; *word is that for the bit after it. */
bool can_bits_start(uint32_t *word);

/* --- The other core, where frames come from and go to --- */

/* Task: false if there is no room. */
bool can_bits_send(const struct can_frame *frame);
/* Irq: the next frame that came; false: none. */
bool can_bits_receive(struct can_frame *frame);
/* Task: which standard id is received besides CAN_ID_ADMIN. */
void can_bits_set_filter(uint16_t id);
void can_bits_read_status(struct can_status *status);

/* --- Whoever has the two provides: tell the other core of frames --- */
void can_bits_tell(void);

#endif
