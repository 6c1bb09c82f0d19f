/* SPDX-License-Identifier: GPL-3.0-or-later
 * A text on the console that asks for the boot loader. */
#ifndef CORE_BOOT_REQUEST_H
#define CORE_BOOT_REQUEST_H

#include <stdint.h>

/* Task: a block without a valid checksum has arrived; does not return if it is
 * the request. */
void boot_request_check(const uint8_t *block, uint8_t len);

#endif
