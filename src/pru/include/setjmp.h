/* SPDX-License-Identifier: GPL-3.0-or-later
 * Of a C library there is only what the firmware needs.
 */
#ifndef PRU_SETJMP_H
#define PRU_SETJMP_H

#include <stdint.h>

typedef uint32_t jmp_buf[12];

int setjmp(jmp_buf env) __attribute__((returns_twice));
/* value is not 0 */
void longjmp(jmp_buf env, int value) __attribute__((noreturn));

#endif
