/* SPDX-License-Identifier: GPL-3.0-or-later
 * What an input of the fuzzer looks like.
 *
 * It is a run of chunks.  The first byte of each tells the number of bytes that
 * follow (6 bits) and how they come: in a proper block, or as they are.  An
 * empty raw chunk lets time pass.  With FUZZ_CONFIGURED in the first chunk the
 * firmware has been configured before; its clock then is FUZZ_CLOCK.
 */
#ifndef FAKEBOARD_FUZZ_INPUT_H
#define FAKEBOARD_FUZZ_INPUT_H

#include <stddef.h>
#include <stdint.h>

enum { FUZZ_LENGTH = 63, FUZZ_RAW = 64, FUZZ_CONFIGURED = 128 };

/* Soon to wrap around. */
#define FUZZ_CLOCK (UINT32_MAX - 100000)

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
