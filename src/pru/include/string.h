/* SPDX-License-Identifier: GPL-3.0-or-later
 * Of a C library there is only what the firmware needs.
 */
#ifndef PRU_STRING_H
#define PRU_STRING_H

#include <stddef.h>

void *memcpy(void *to, const void *from, size_t size);
void *memmove(void *to, const void *from, size_t size);
void *memset(void *to, int value, size_t size);
void *memchr(const void *data, int value, size_t size);

#endif
