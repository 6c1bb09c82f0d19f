/* SPDX-License-Identifier: GPL-3.0-or-later
 * Messages for the fuzzer. */
#ifndef FAKEBOARD_FUZZ_MESSAGE_H
#define FAKEBOARD_FUZZ_MESSAGE_H

#include <stdint.h>

enum { FUZZ_MESSAGE_MAX = 64 };

/* The number of a command that a configured mcu is asked, and the oid of an
 * object for it. */
uint32_t fuzz_pick_command(uint8_t *oid, uint32_t *seed);

/* Append one message, at most FUZZ_MESSAGE_MAX bytes; returns its end. */
uint8_t *fuzz_put_message(uint8_t *p, uint32_t *seed);

#endif
