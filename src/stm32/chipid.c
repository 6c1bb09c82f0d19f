/* SPDX-License-Identifier: GPL-3.0-or-later
 * The unique device id, 96 bits (RM0008, 30.2; RM0091, 33.1; RM0433, 61.1). */
#include "board/chipid.h"
#include "chip.h"

const uint8_t *chipid_get(uint8_t *len)
{
    *len = 12;
    return (const uint8_t *)UID_ADDR;
}
