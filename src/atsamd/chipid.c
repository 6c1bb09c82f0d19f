/* SPDX-License-Identifier: GPL-3.0-or-later
 * The serial number: four words, not all in a row (data sheets, chapter
 * Memories). */
#include "board/chipid.h"
#include "chip.h"
#include "core/sched.h"

static const uint32_t places[] = { SERIAL_NUMBER_WORDS };
static uint32_t words[sizeof(places) / sizeof(places[0])];

void chipid_init(void)
{
    uint32_t i;

    for (i = 0; i < sizeof(places) / sizeof(places[0]); i++)
        words[i] = *(volatile uint32_t *)places[i];
}
DECL_INIT(chipid_init);

const uint8_t *chipid_get(uint8_t *len)
{
    *len = sizeof(words);
    return (const uint8_t *)words;
}
