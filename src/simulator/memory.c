/* SPDX-License-Identifier: GPL-3.0-or-later
 * Memory of the simulated mcu, and its power cycle: firmware expects fresh
 * variables at every start, so the first start takes a copy of them. */
#include <stdlib.h>
#include <string.h>

#include "board/mem.h"
#include "world.h"

enum { ARENA_SIZE = 128 * 1024, DEBUG_SIZE = 64 };

/* Bounds of all variables, set by firmware.ld. */
extern uint8_t simulator_data_start[], simulator_data_end[];
static uint8_t *first_copy;
static uint8_t arena[ARENA_SIZE] __attribute__((aligned(16)));
static uint8_t debug_memory[DEBUG_SIZE];

/* memcpy() that steps over the gaps between variables, which the address
 * sanitizer guards. */
__attribute__((no_sanitize("address", "undefined")))
static void copy_all(uint8_t *to, const uint8_t *from, size_t size)
{
#ifdef __SANITIZE_ADDRESS__
    for (volatile size_t i = 0; i < size; i++)
        to[i] = from[i];
#else
    memcpy(to, from, size);
#endif
}

void simulator_restore_memory(void)
{
    size_t size = (size_t)(simulator_data_end - simulator_data_start);
    uint8_t *copy = first_copy;

    if (copy) {
        copy_all(simulator_data_start, copy, size);
        first_copy = copy;
        return;
    }
    first_copy = malloc(size);
    if (first_copy)
        copy_all(first_copy, simulator_data_start, size);
}

/* The world closes its copy of the library. */
static __attribute__((destructor)) void drop_first_copy(void)
{
    free(first_copy);
}

void *mem_get_arena(size_t *size)
{
    *size = sizeof(arena);
    return arena;
}

/* A few bytes to try the commands on: no address of the process is valid. */
uint32_t mem_debug_read(uint8_t order, uint32_t addr)
{
    uint32_t val = 0;

    if (order <= 2 && addr <= DEBUG_SIZE - 4)
        memcpy(&val, &debug_memory[addr], (size_t)1 << order);
    return val;
}

void mem_debug_write(uint8_t order, uint32_t addr, uint32_t val)
{
    if (order <= 2 && addr <= DEBUG_SIZE - 4)
        memcpy(&debug_memory[addr], &val, (size_t)1 << order);
}
