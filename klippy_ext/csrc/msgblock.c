/* SPDX-License-Identifier: GPL-3.0-or-later
 * Framing and integers of the wire protocol.  See msgblock.h. */
#include <string.h>

#include "msgblock.h"

/* Reflected polynomial 0x8408, one nibble at a time: 32 bytes of table stay
 * in one cache line, and blocks are short. */
static const uint16_t crc_nibble[16] = {
    0x0000, 0x1081, 0x2102, 0x3183, 0x4204, 0x5285, 0x6306, 0x7387,
    0x8408, 0x9489, 0xa50a, 0xb58b, 0xc60c, 0xd68d, 0xe70e, 0xf78f,
};

uint16_t
msgblock_crc16(const uint8_t *buf, size_t len)
{
    unsigned crc = 0xffff;

    for (size_t i = 0; i < len; i++) {
        crc ^= buf[i];
        crc = (crc >> 4) ^ crc_nibble[crc & 15];
        crc = (crc >> 4) ^ crc_nibble[crc & 15];
    }
    return (uint16_t)crc;
}

/* Bytes up to and including the first sync byte, all if there is none. */
static int
count_to_sync(const uint8_t *buf, size_t len)
{
    const uint8_t *sync = memchr(buf, MSGBLOCK_SYNC, len);

    if (len > MSGBLOCK_MAX && (!sync || sync - buf >= MSGBLOCK_MAX))
        return MSGBLOCK_MAX;
    return sync ? (int)(sync - buf) + 1 : (int)len;
}

int
msgblock_check(const uint8_t *buf, size_t len)
{
    size_t size;
    uint16_t crc;

    if (!len)
        return 0;
    size = buf[0];
    if (size < MSGBLOCK_MIN || size > MSGBLOCK_MAX)
        return -count_to_sync(buf, len);
    if (len >= 2 && (buf[1] & ~MSGBLOCK_SEQ_MASK) != MSGBLOCK_DEST)
        return -count_to_sync(buf, len);
    if (len < size)
        return 0;
    crc = msgblock_crc16(buf, size - MSGBLOCK_TRAILER);
    if (buf[size - 1] != MSGBLOCK_SYNC || buf[size - 3] != crc >> 8
        || buf[size - 2] != (crc & 0xff))
        return -count_to_sync(buf, len);
    return (int)size;
}

size_t
msgblock_build(uint8_t *out, uint8_t seq, const uint8_t *payload, size_t len)
{
    size_t end = MSGBLOCK_HEADER + len;
    uint16_t crc;

    if (len && payload != out + MSGBLOCK_HEADER)
        memmove(out + MSGBLOCK_HEADER, payload, len);
    out[0] = (uint8_t)(len + MSGBLOCK_MIN);
    out[1] = (uint8_t)(MSGBLOCK_DEST | (seq & MSGBLOCK_SEQ_MASK));
    crc = msgblock_crc16(out, end);
    out[end] = (uint8_t)(crc >> 8);
    out[end + 1] = (uint8_t)(crc & 0xff);
    out[end + 2] = MSGBLOCK_SYNC;
    return end + MSGBLOCK_TRAILER;
}

/* n groups of 7 bits cover the values from -2^(7n-2) up to 3*2^(7n-2)-1: the
 * top group's value 0x60 and above stands for a negative number. */
uint8_t *
msgblock_put_int(uint8_t *p, uint32_t v)
{
    int groups = 1;

    while (groups < MSGBLOCK_VLQ_MAX) {
        uint32_t quarter = UINT32_C(1) << (7 * groups - 2);
        if (v + quarter < 4 * quarter)
            break;
        groups++;
    }
    while (--groups > 0)
        *p++ = (uint8_t)(0x80 | ((v >> (7 * groups)) & 0x7f));
    *p++ = (uint8_t)(v & 0x7f);
    return p;
}

int
msgblock_get_int(const uint8_t **pp, const uint8_t *end, uint32_t *v)
{
    const uint8_t *p = *pp;
    uint32_t value;

    if (p >= end)
        return -1;
    value = *p & 0x7f;
    if (value >= 0x60)
        value -= 0x80;
    while (*p++ & 0x80) {
        if (p >= end || p - *pp >= MSGBLOCK_VLQ_MAX)
            return -1;
        value = value << 7 | (*p & 0x7f);
    }
    *pp = p;
    *v = value;
    return 0;
}
