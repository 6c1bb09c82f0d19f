/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Threads that work beside the main thread: the steps of each stepper are one
 * piece of work.
 *
 * The main thread adds pieces, starts them, goes on with something else, and
 * finishes them: it takes on those that nobody has begun and waits for the
 * rest.  Pieces may run in any order and at the same time, so none may depend
 * on another; then results do not depend on the number of threads.  With no
 * thread all is done in finish().
 *
 * While pieces run, what they use belongs to them.  Who wants it calls
 * steppool_settle() first.
 *
 * Threads: add() and start() are the main thread's; finish() and settle() may
 * be called by any.
 */
#ifndef STEPPOOL_H
#define STEPPOOL_H

#include <stdatomic.h>
#include <stddef.h>

struct steppool;

/* n_threads: besides the main one, 0 or more; they begin when they are first
 * needed.  NULL when out of memory. */
struct steppool *steppool_new(int n_threads);
/* Finishes what was started. */
void steppool_delete(struct steppool *p);

/* One more piece of work.  Returns 0 or -ENOMEM. */
int steppool_add(struct steppool *p, void (*work)(void *ctx), void *ctx);
/* Begin all pieces that were added. */
void steppool_start(struct steppool *p);
/* Returns when all are done. */
void steppool_finish(struct steppool *p);

/* 0 if all counts agree with each other, else -EINVAL. */
int steppool_check(struct steppool *p);

/* The pool whose pieces run, or NULL. */
extern struct steppool *_Atomic steppool_running;

/* Finish what runs, if anything does. */
static inline void
steppool_settle(void)
{
    struct steppool *p = atomic_load_explicit(&steppool_running,
                                              memory_order_acquire);

    if (p)
        steppool_finish(p);
}

#endif
