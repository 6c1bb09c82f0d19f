/* SPDX-License-Identifier: GPL-3.0-or-later
 * The second core: it sleeps in the boot ROM until it is given a program.
 */
#ifndef RP2040_CORE1_H
#define RP2040_CORE1_H

#include <stdint.h>

/* Task or start: run `program` there, interrupts off, with a stack that ends at
 * `stack_top`.  It never returns. */
void core1_start(void (*program)(void), uint32_t *stack_top);

/* Either core: wake the other, or interrupt it (SIO_FIFO_IRQ). */
void core1_ring(void);
/* Either core: take back what the other has rung. */
void core1_answer(void);

#endif
