/* SPDX-License-Identifier: GPL-3.0-or-later
 * The RP2350's unique number: first four rows of its fuses, 16 bits each (data
 * sheet, 13.10). */
#include "board/chipid.h"
#include "chip.h"
#include "core/sched.h"

static uint32_t words[2];

void chipid_init(void)
{
    words[0] = ((volatile uint32_t *)OTP_DATA_BASE)[0];
    words[1] = ((volatile uint32_t *)OTP_DATA_BASE)[1];
}
DECL_INIT(chipid_init);

const uint8_t *chipid_get(uint8_t *len)
{
    *len = sizeof(words);
    return (const uint8_t *)words;
}
