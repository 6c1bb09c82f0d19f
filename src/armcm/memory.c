/* SPDX-License-Identifier: GPL-3.0-or-later
 * Memory and registers by their addresses, for the debug commands. */
#include "board/mem.h"

uint32_t mem_debug_read(uint8_t order, uint32_t addr)
{
    if (order == 0)
        return *(volatile uint8_t *)addr;
    if (order == 1)
        return *(volatile uint16_t *)addr;
    return *(volatile uint32_t *)addr;
}

void mem_debug_write(uint8_t order, uint32_t addr, uint32_t val)
{
    if (order == 0)
        *(volatile uint8_t *)addr = (uint8_t)val;
    else if (order == 1)
        *(volatile uint16_t *)addr = (uint16_t)val;
    else
        *(volatile uint32_t *)addr = val;
}
