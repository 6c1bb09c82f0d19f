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

void simulator_restore_memory(void)
{
    size_t size = (size_t)(simulator_data_end - simulator_data_start);
    uint8_t *copy = first_copy;

    if (copy) {
        memcpy(simulator_data_start, copy, size);
        first_copy = copy;
        return;
    }
    first_copy = malloc(size);
    if (first_copy)
        memcpy(first_copy, simulator_data_start, size);
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
