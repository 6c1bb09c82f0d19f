/* SPDX-License-Identifier: GPL-3.0-or-later
 * Numbers and byte strings within messages. */
#include <stdbool.h>
#include <string.h>

#include "core/command.h"
#include "core/sched.h"
#include "core/tables.h"

enum { INT_MAX_BYTES = 5 };

/* The last byte's sign bits say whether the number is negative: 0x60 and up
 * continue below zero. */
int command_get_int(const uint8_t **p, const uint8_t *end, uint32_t *value)
{
    const uint8_t *pos = *p;
    uint32_t v = 0;
    uint8_t byte, n = 0;

    do {
        if (pos >= end || n++ >= INT_MAX_BYTES)
            return false;
        byte = *pos++;
        if (n == 1 && (byte & 0x60) == 0x60)
            v = UINT32_MAX;
        v = (v << 7) | (byte & 0x7f);
    } while (byte & 0x80);
    *p = pos;
    *value = v;
    return true;
}

uint8_t *command_put_int(uint8_t *p, uint32_t value)
{
    uint8_t groups[INT_MAX_BYTES], n = 0;
    int32_t rest = (int32_t)value;

    while (rest > 0x5f || rest < -0x20) {
        groups[n++] = (uint8_t)(rest & 0x7f);
        rest >>= 7;
    }
    groups[n] = (uint8_t)(rest & 0x7f);
    while (n)
        *p++ = (uint8_t)(groups[n--] | 0x80);
    *p++ = groups[0];
    return p;
}

uint8_t *command_put_bytes(uint8_t *p, uint8_t len, const uint8_t *data)
{
    *p++ = len;
    memcpy(p, data, len);
    return p + len;
}

uint8_t *command_put_rom(uint8_t *p, uint8_t len, const ROM uint8_t *data)
{
    *p++ = len;
    while (len--)
        *p++ = *data++;
    return p;
}

/* Fill in one args struct; returns where the message ends. */
const uint8_t *command_parse_args(const uint8_t *p, const uint8_t *end,
                                  const ROM struct command_entry *entry,
                                  command_slot_t *slot)
{
    uint16_t buffers = entry->buffers;
    uint8_t n = entry->n_params;
    uint32_t value;

    for (; n; n--, buffers >>= 1) {
        if (!command_get_int(&p, end, &value))
            shutdown("Command parser error");
        *slot++ = value;
        if (!(buffers & 1))
            continue;
        if (value > (uint32_t)(end - p))
            shutdown("Command parser error");
        *slot++ = (command_slot_t)(uintptr_t)p;
        p += value;
    }
    return p;
}
