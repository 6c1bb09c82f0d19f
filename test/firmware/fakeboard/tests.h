/* SPDX-License-Identifier: GPL-3.0-or-later
 * The C tests; each exits with a message when something is wrong. */
#ifndef FAKEBOARD_TESTS_H
#define FAKEBOARD_TESTS_H

#include <stdio.h>
#include <stdlib.h>

#define CHECK(COND) do { \
    if (!(COND)) { \
        fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #COND); \
        exit(1); \
    } } while (0)

void test_sched(uint32_t seed);
void test_injection(uint32_t first, uint32_t stride);
void test_races(void);
void fuzz_command(uint32_t seed);

/* Pseudo random numbers, the same everywhere. */
static inline uint32_t next_random(uint32_t *state)
{
    *state = *state * 1664525 + 1013904223;
    return *state >> 8;
}

#endif
