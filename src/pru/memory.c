/* SPDX-License-Identifier: GPL-3.0-or-later
 * Memory of PRU1: objects and the move queue have what the cores share. */
#include "board/mem.h"

enum { SHARED_ADDR = 0x10000, SHARED_SIZE = 12288 };

void *mem_get_arena(size_t *size)
{
    *size = SHARED_SIZE;
    return (void *)SHARED_ADDR;
}

uint32_t mem_debug_read(uint8_t order, uint32_t addr)
{
    switch (order) {
    case 0: return *(volatile uint8_t *)addr;
    case 1: return *(volatile uint16_t *)addr;
    default: return *(volatile uint32_t *)addr;
    }
}

void mem_debug_write(uint8_t order, uint32_t addr, uint32_t val)
{
    switch (order) {
    case 0: *(volatile uint8_t *)addr = (uint8_t)val; break;
    case 1: *(volatile uint16_t *)addr = (uint16_t)val; break;
    default: *(volatile uint32_t *)addr = val; break;
    }
}
