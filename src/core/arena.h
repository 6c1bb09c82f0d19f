/* SPDX-License-Identifier: GPL-3.0-or-later
 * All memory of the firmware.
 *
 * While the mcu is configured, objects are cut off the front of one arena; when
 * the configuration is finalised the rest becomes equal cells for queued
 * moves, as large as the largest that anybody asked for.
 */
#ifndef CORE_ARENA_H
#define CORE_ARENA_H

#include <stdint.h>

/* Task, before finalising: zeroed memory that lives until the next reset. */
void *arena_alloc(uint16_t size);

/* Task, before finalising: movecell_take() will be used with this size. */
void movecell_request(uint16_t size);

/* Any context: a cell for one queued move (not zeroed), and back. */
void *movecell_take(void);
void movecell_give(void *cell);
void movecell_give_irq(void *cell); /* irqs off */

/* For ports whose timer interrupt gives cells back itself: the first of those
 * that are free, which begins with a pointer to the next. */
extern struct movecell *movecell_free;

/* Task: turn the rest into cells; or into an empty arena again. */
void arena_finalize(void);
void arena_reset(void);

/* Number of move cells; 0 before finalising. */
uint16_t movecell_count(void);

#endif
