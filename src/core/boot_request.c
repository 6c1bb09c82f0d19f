/* SPDX-License-Identifier: GPL-3.0-or-later
 * A text on the console that asks for the boot loader.
 *
 * It has the shape of a block, of 32 bytes, whose checksum is wrong: a program
 * that sends it needs to know nothing of the protocol, and no message of the
 * host can be taken for it.
 */
#include "board/mem.h"
#include "board/reset.h"
#include "core/boot_request.h"

static const ROM char request[] = " \x1c Request Serial Bootloader!! ~";

void boot_request_check(const uint8_t *block, uint8_t len)
{
    uint8_t i;

    if (len != sizeof(request) - 1)
        return;
    for (i = 0; i < len; i++)
        if (block[i] != (uint8_t)request[i])
            return;
    reset_to_bootloader();
}
