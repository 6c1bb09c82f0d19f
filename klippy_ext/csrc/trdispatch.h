/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Triggers shared by mcus: when the trigger of one mcu fires, the host fires
 * those of all others at once, on the I/O threads, without Python.
 *
 * While armed, each mcu reports its trigger's state now and then.  Every mcu
 * may go on until expire_ticks after the oldest of all last reports, so that
 * one that falls silent stops all within the timeout.  A timeout is moved on
 * only by min_extend_ticks or more.
 *
 * Threads: report handlers run on the I/O threads of their queues; the lock
 * guards all fields.  It is never held while a reader is added or removed.
 * A trdispatch is one malloc() block and may be ended by free() once stopped.
 */
#ifndef TRDISPATCH_H
#define TRDISPATCH_H

#include "serialqueue.h"

struct trdispatch;
struct trmember;

struct trmember_tags {
    uint32_t oid;               /* of the trigger on its mcu */
    uint32_t set_timeout, trigger, state;       /* message numbers */
};

struct trdispatch *trdispatch_new(void);
void trdispatch_free(struct trdispatch *td);

/* The member holds sq and cq without owning them.  NULL: out of memory. */
struct trmember *trdispatch_add(struct trdispatch *td, struct serialqueue *sq,
                                struct cmdqueue *cq,
                                const struct trmember_tags *tags);
/* The member must not be armed. */
void trmember_free(struct trmember *tm);
/* Clock of the start of the trigger, and how long it lives unanswered. */
void trmember_setup(struct trmember *tm, uint64_t clock,
                    uint64_t expire_ticks, uint64_t min_extend_ticks);

/* Follow the reports; a trigger is passed on with this reason. */
void trdispatch_arm(struct trdispatch *td, uint32_t reason);
void trdispatch_disarm(struct trdispatch *td);
/* 0, or a negative number that says which invariant does not hold. */
int trdispatch_check(struct trdispatch *td);

#endif
