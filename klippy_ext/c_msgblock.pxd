# SPDX-License-Identifier: GPL-3.0-or-later
from libc.stdint cimport uint8_t, uint16_t, uint32_t


cdef extern from "msgblock.h" nogil:
    enum:
        MSGBLOCK_MIN
        MSGBLOCK_MAX
        MSGBLOCK_PAYLOAD_MAX
        MSGBLOCK_VLQ_MAX

    uint16_t msgblock_crc16(const uint8_t *buf, size_t len)
    int msgblock_check(const uint8_t *buf, size_t len)
    size_t msgblock_build(
        uint8_t *out, uint8_t seq, const uint8_t *payload, size_t len)
    uint8_t *msgblock_put_int(uint8_t *p, uint32_t v)
    int msgblock_get_int(
        const uint8_t **pp, const uint8_t *end, uint32_t *v)
