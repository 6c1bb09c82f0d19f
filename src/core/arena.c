/* SPDX-License-Identifier: GPL-3.0-or-later
 * All memory of the firmware. */
#include <stddef.h>
#include <string.h>

#include "board/irq.h"
#include "board/mem.h"
#include "core/arena.h"
#include "core/sched.h"

#define CELL_COUNT_MAX 0x7fff
#define ALIGN_UP(X) (((X) + sizeof(void *) - 1) & ~(sizeof(void *) - 1))

/* A free cell holds the link to the next one. */
struct movecell {
    struct movecell *next;
};

static uint8_t *arena_pos, *arena_end;
struct movecell *movecell_free;
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
    struct movecell *cell = movecell_free;

    if (!cell)
        shutdown("Move queue overflow");
    movecell_free = cell->next;
    irq_restore(flag);
    return cell;
}

void movecell_give_irq(void *data)
{
    struct movecell *cell = data;

    cell->next = movecell_free;
    movecell_free = cell;
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

/* Chain as many cells as there is room for, the first at the lowest address. */
static void link_cells(void)
{
    struct movecell **link = &movecell_free;
    uint8_t *pos = arena_pos;

    cell_count = 0;
    while ((size_t)(arena_end - pos) >= cell_size
           && cell_count < CELL_COUNT_MAX) {
        *link = (struct movecell *)(void *)pos;
        link = &(*link)->next;
        pos += cell_size;
        cell_count++;
    }
    *link = NULL;
}

void arena_finalize(void)
{
    if (cell_size < sizeof(struct movecell))
        cell_size = sizeof(struct movecell);
    link_cells();
    if (!cell_count)
        shutdown("alloc_chunks failed");
}

void arena_reset(void)
{
    size_t size;

    arena_pos = mem_get_arena(&size);
    arena_end = arena_pos + size;
    movecell_free = NULL;
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
