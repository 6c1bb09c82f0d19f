/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Framing and integers of the wire protocol, both directions.
 *
 * A block is: length (5..64, all bytes), sequence (0x10 | 4 bits), payload,
 * CRC16-CCITT over what precedes (high byte first), sync byte 0x7e.  The
 * payload is a run of messages made of variable length quantities (VLQ) and
 * length-prefixed byte strings.  An empty block acknowledges.
 *
 * Functions read only the bytes they are given and keep no state.
 */
#ifndef MSGBLOCK_H
#define MSGBLOCK_H

#include <stddef.h>
#include <stdint.h>

enum {
    MSGBLOCK_MIN = 5, MSGBLOCK_MAX = 64,
    MSGBLOCK_HEADER = 2, MSGBLOCK_TRAILER = 3,
    MSGBLOCK_PAYLOAD_MAX = MSGBLOCK_MAX - MSGBLOCK_MIN,
    MSGBLOCK_SYNC = 0x7e,
    MSGBLOCK_SEQ_MASK = 0x0f, MSGBLOCK_DEST = 0x10,
    MSGBLOCK_VLQ_MAX = 5,
};

/* CRC16-CCITT as the protocol wants it (reflected, start value 0xffff). */
uint16_t msgblock_crc16(const uint8_t *buf, size_t len);

/* Look for a block at the start of buf.
 * > 0: a valid block of that many bytes starts at buf[0].
 *   0: what is there may become a block; more bytes are needed.
 * < 0: that many bytes are no block (garbage, or lone sync bytes): skip. */
int msgblock_check(const uint8_t *buf, size_t len);

/* Frame `len` payload bytes (<= 59) into out[MSGBLOCK_MAX].  Returns the
 * size of the block.  payload may lie at out + MSGBLOCK_HEADER already. */
size_t msgblock_build(uint8_t *out, uint8_t seq, const uint8_t *payload,
                      size_t len);

/* Append v to p, which has room for MSGBLOCK_VLQ_MAX bytes.  Values are 32
 * bit; signed and unsigned share one encoding.  Returns the new end. */
uint8_t *msgblock_put_int(uint8_t *p, uint32_t v);

/* Read one integer from [*pp, end) and advance *pp.  Returns 0, or -1 (with
 * *pp unchanged) when it is cut short or longer than 5 bytes. */
int msgblock_get_int(const uint8_t **pp, const uint8_t *end, uint32_t *v);

#endif
