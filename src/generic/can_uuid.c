/* SPDX-License-Identifier: GPL-3.0-or-later
 * Six bytes made of the chip's id by the hash "fasthash64" (Z. Tan, MIT), with
 * the seed that boot loaders for CAN use too: a board keeps its name.
 */
#include <string.h>

#include "board/chipid.h"
#include "generic/can_uuid.h"

#define SEED 0xa16231a7ull
#define FACTOR 0x880355f21e6d1965ull
#define MIX_FACTOR 0x2127599bf4325c37ull

static uint8_t uuid[CAN_UUID_SIZE];

static uint64_t mix(uint64_t h)
{
    h ^= h >> 23;
    h *= MIX_FACTOR;
    return h ^ h >> 47;
}

static uint64_t hash(const uint8_t *data, uint8_t len)
{
    uint64_t h = SEED ^ len * FACTOR, word;
    uint8_t n;

    for (; len; len = (uint8_t)(len - n), data += n) {
        n = len < 8 ? len : 8;
        word = 0;
        memcpy(&word, data, n);
        h = (h ^ mix(word)) * FACTOR;
    }
    return mix(h);
}

/* Made when it is asked for: some ports know their id only once all has been
 * initialized. */
const uint8_t *can_uuid_get(void)
{
    uint8_t len;
    const uint8_t *id = chipid_get(&len);
    uint64_t h = hash(id, len);

    memcpy(uuid, &h, sizeof(uuid));
    return uuid;
}
