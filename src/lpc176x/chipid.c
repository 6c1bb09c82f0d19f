/* SPDX-License-Identifier: GPL-3.0-or-later
 * The unique number: sixteen bytes that the boot ROM tells (UM10360, 32.7.10).
 * Its functions use the last 32 bytes of memory. */
#include "board/chipid.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"

typedef void (*iap_t)(const uint32_t *command, uint32_t *result);

/* Status, then the number */
static uint32_t result[5];

void chipid_init(void)
{
    static const uint32_t command[5] = { IAP_READ_SERIAL };
    irq_flag_t flag = irq_save();

    ((iap_t)IAP_ENTRY)(command, result);
    irq_restore(flag);
}
DECL_INIT(chipid_init);

const uint8_t *chipid_get(uint8_t *len)
{
    *len = 16;
    return (const uint8_t *)&result[1];
}
