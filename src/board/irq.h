/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: interrupts.
 *
 * A port's folder is on the include path; its "port.h" defines every handle
 * type of these contracts and may define any of the functions as static
 * inline (a later plain declaration keeps the internal linkage).
 */
#ifndef BOARD_IRQ_H
#define BOARD_IRQ_H

#include <stdint.h>
#include "port.h" /* defines irq_flag_t: what irq_save() has to remember */

/* --- The port provides --- */

/* Any context.  A compiler barrier both ways. */
void irq_disable(void);
void irq_enable(void);

/* Any context; nests.  `flag` is the state to return to. */
irq_flag_t irq_save(void);
void irq_restore(irq_flag_t flag);

/* Task, called with irqs off and returning so: sleep until an interrupt has
 * been served.  Must not lose one that is already pending; may return early.
 * Blocks without bound. */
void irq_wait(void);

/* Task: serve what polling ports (no real interrupts) must serve between
 * tasks; empty elsewhere.  Never blocks. */
void irq_poll(void);

/* --- The core provides (core/sched.h) --- */

/* Runs the firmware; the port's main() or reset handler ends here. */
void sched_main(void) __attribute__((noreturn));

#endif
