# SPDX-License-Identifier: GPL-3.0-or-later
"""Blocks and integers of the wire protocol, for consoles, dumps and tests."""

from libc.stdint cimport uint8_t, uint32_t

from klippy_ext.c_msgblock cimport (
    MSGBLOCK_MAX,
    MSGBLOCK_MIN,
    MSGBLOCK_PAYLOAD_MAX,
    MSGBLOCK_VLQ_MAX,
    msgblock_build,
    msgblock_check,
    msgblock_crc16,
    msgblock_get_int,
    msgblock_put_int,
)

BLOCK_MIN = MSGBLOCK_MIN
BLOCK_MAX = MSGBLOCK_MAX
PAYLOAD_MAX = MSGBLOCK_PAYLOAD_MAX


def crc16(const uint8_t[::1] data):
    """CRC16-CCITT of data as the wire protocol computes it."""
    return msgblock_crc16(&data[0] if data.shape[0] else NULL, data.shape[0])


def encode_int(value):
    """Variable length encoding of the low 32 bits of an integer."""
    cdef uint8_t out[MSGBLOCK_VLQ_MAX]
    cdef uint8_t *end = msgblock_put_int(out, <uint32_t>(value & 0xffffffff))
    return out[:end - out]


def decode_int(const uint8_t[::1] data, Py_ssize_t pos=0):
    """Read one integer at data[pos].

    Returns (value as unsigned 32 bit, position behind it).
    Raises ValueError if the integer is cut short.
    """
    cdef const uint8_t *start
    cdef const uint8_t *at
    cdef uint32_t value = 0
    if not 0 <= pos < data.shape[0]:
        raise ValueError(
            "no integer at byte %d: the message has %d bytes"
            % (pos, data.shape[0]))
    start = &data[0]
    at = start + pos
    if msgblock_get_int(&at, start + data.shape[0], &value):
        raise ValueError(
            "integer at byte %d is cut short or longer than 5 bytes: %s"
            % (pos, bytes(data[pos:]).hex()))
    return value, at - start


def make_block(const uint8_t[::1] payload, seq):
    """Frame a payload of at most 59 bytes; the low 4 bits of seq are used."""
    cdef uint8_t out[MSGBLOCK_MAX]
    cdef size_t size
    if payload.shape[0] > MSGBLOCK_PAYLOAD_MAX:
        raise ValueError(
            "a block holds at most %d payload bytes, not %d"
            % (MSGBLOCK_PAYLOAD_MAX, payload.shape[0]))
    size = msgblock_build(
        out, <uint8_t>(seq & 15), &payload[0] if payload.shape[0] else NULL,
        payload.shape[0])
    return out[:size]


def check_block(const uint8_t[::1] data):
    """Look for a block at the start of data.

    Returns its size (> 0), 0 if more bytes are needed, or minus the number
    of leading bytes that are no block.
    """
    return msgblock_check(&data[0] if data.shape[0] else NULL, data.shape[0])


def split_blocks(bytes data):
    """Find all blocks in a stream of bytes.

    Returns (list of (sequence, payload), number of bytes skipped, rest that
    may still become a block).
    """
    cdef const uint8_t *start = data
    cdef size_t pos = 0
    cdef size_t length = len(data)
    cdef size_t skipped = 0
    cdef int found
    blocks = []
    while pos < length:
        found = msgblock_check(start + pos, length - pos)
        if found == 0:
            break
        if found < 0:
            skipped += <size_t>-found
            pos += <size_t>-found
            continue
        blocks.append((data[pos + 1] & 15, data[pos + 2:pos + found - 3]))
        pos += <size_t>found
    return blocks, skipped, data[pos:]
