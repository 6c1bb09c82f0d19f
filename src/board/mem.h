/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: memory.
 */
#ifndef BOARD_MEM_H
#define BOARD_MEM_H

#include <stddef.h>
#include <stdint.h>
#include "port.h"

/* --- The port provides --- */

/* ROM, a macro: qualifier of constant data that lies in program memory and of
 * pointers to it, as in `static const ROM uint8_t table[]`.  `__flash` on AVR,
 * empty where constants are in the address space anyway. */
#ifndef ROM
#define ROM
#endif

/* Task, once at start: the memory that nothing else uses (stack kept clear),
 * aligned for any type.  All objects and the move queue come from it. */
void *mem_get_arena(size_t *size);

/* Any context: read or write `1 << order` bytes at an address, for the debug
 * commands.  order is 0, 1 or 2. */
uint32_t mem_debug_read(uint8_t order, uint32_t addr);
void mem_debug_write(uint8_t order, uint32_t addr, uint32_t val);

#endif
