/* SPDX-License-Identifier: GPL-3.0-or-later
 * All memory of the firmware. */
#include <stddef.h>
#include <string.h>

#include "board/irq.h"
#include "board/mem.h"
#include "core/arena.h"
#include "core/sched.h"

#define ALIGN_UP(X) (((X) + sizeof(void *) - 1) & ~(sizeof(void *) - 1))

/* A free cell holds the link to the next one. */
struct cell {
    struct cell *next;
};

static uint8_t *arena_pos, *arena_end;
static struct cell *free_cells;
static uint16_t cell_size, cell_count;

void *arena_alloc(uint16_t size)
{
    size_t need = ALIGN_UP(size);
    void *data = arena_pos;

    if ((size_t)(arena_end - arena_pos) < need)
        shutdown("alloc_chunk failed");
    arena_pos += need;
    memset(data, 0, need);
    return data;
}

void movecell_request(uint16_t size)
{
    if (size > UINT16_MAX - sizeof(void *) || cell_count)
        shutdown("Invalid move request size");
    if (size > cell_size)
        cell_size = (uint16_t)ALIGN_UP(size);
}

void *movecell_take(void)
{
    irq_flag_t flag = irq_save();
    struct cell *cell = free_cells;

    if (!cell)
        shutdown("Move queue overflow");
    free_cells = cell->next;
    irq_restore(flag);
    return cell;
}

void movecell_give_irq(void *data)
{
    struct cell *cell = data;

    cell->next = free_cells;
    free_cells = cell;
}

void movecell_give(void *data)
{
    irq_flag_t flag = irq_save();

    movecell_give_irq(data);
    irq_restore(flag);
}

uint16_t movecell_count(void)
{
    return cell_count;
}

/* Chain all cells, the first at the lowest address. */
static void link_cells(void)
{
    uint8_t *pos = arena_pos + (size_t)cell_size * cell_count;

    free_cells = NULL;
    while (pos > arena_pos) {
        struct cell *cell;
        pos -= cell_size;
        cell = (struct cell *)(void *)pos;
        cell->next = free_cells;
        free_cells = cell;
    }
}

void arena_finalize(void)
{
    size_t count;

    if (cell_size < sizeof(struct cell))
        cell_size = sizeof(struct cell);
    count = (size_t)(arena_end - arena_pos) / cell_size;
    if (!count)
        shutdown("alloc_chunks failed");
    cell_count = count > 0x7fff ? 0x7fff : (uint16_t)count;
    link_cells();
}

void arena_reset(void)
{
    size_t size;

    arena_pos = mem_get_arena(&size);
    arena_end = arena_pos + size;
    free_cells = NULL;
    cell_size = cell_count = 0;
}
DECL_INIT(arena_reset);

/* Users of the queues have dropped them: all cells are free. */
void arena_shutdown(void)
{
    if (cell_count)
        link_cells();
}
DECL_SHUTDOWN(arena_shutdown);
