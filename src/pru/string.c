/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the compiler, and the firmware, take from a C library. */
#include <stdint.h>
#include <string.h>

__attribute__((used)) void *memcpy(void *to, const void *from, size_t size)
{
    uint8_t *out = to;
    const uint8_t *in = from;

    while (size--)
        *out++ = *in++;
    return to;
}

void *memmove(void *to, const void *from, size_t size)
{
    uint8_t *out = to;
    const uint8_t *in = from;

    if (out <= in)
        return memcpy(to, from, size);
    while (size--)
        out[size] = in[size];
    return to;
}

__attribute__((used)) void *memset(void *to, int value, size_t size)
{
    uint8_t *out = to;

    while (size--)
        *out++ = (uint8_t)value;
    return to;
}

__attribute__((used)) void *memchr(const void *data, int value, size_t size)
{
    const uint8_t *pos = data;

    for (; size; size--, pos++)
        if (*pos == (uint8_t)value)
            return (void *)pos;
    return NULL;
}
