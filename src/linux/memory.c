/* SPDX-License-Identifier: GPL-3.0-or-later
 * Memory of the linux process.  Addresses of the debug commands count from the
 * start of the arena: no address of the process itself can be reached. */
#include <string.h>

#include "board/mem.h"

enum { ARENA_SIZE = 256 * 1024 };

static uint8_t arena[ARENA_SIZE] __attribute__((aligned(16)));

void *mem_get_arena(size_t *size)
{
    *size = sizeof(arena);
    return arena;
}

uint32_t mem_debug_read(uint8_t order, uint32_t addr)
{
    uint32_t val = 0;

    if (order <= 2 && addr <= ARENA_SIZE - sizeof(val))
        memcpy(&val, &arena[addr], (size_t)1 << order);
    return val;
}

void mem_debug_write(uint8_t order, uint32_t addr, uint32_t val)
{
    if (order <= 2 && addr <= ARENA_SIZE - sizeof(val))
        memcpy(&arena[addr], &val, (size_t)1 << order);
}
