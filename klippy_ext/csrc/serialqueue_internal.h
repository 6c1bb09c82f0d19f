/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the serial queue and its drivers share. */
#ifndef SERIALQUEUE_INTERNAL_H
#define SERIALQUEUE_INTERNAL_H

#include <pthread.h>

#include "serialqueue.h"

/* kick(): messages were queued (lock held).  stop(): end all I/O, give the
 * memory back (lock not held). */
struct sqdriver {
    void (*kick)(struct serialqueue *sq);
    void (*stop)(struct serialqueue *sq);
};

struct serialqueue {
    pthread_mutex_t lock;       /* guards all but readers */
    pthread_mutex_t reader_lock;
    pthread_cond_t arrived;
    struct hostclock *clock;
    const struct sqdriver *driver;
    void *driver_state;
    struct sqcore core;
    struct qfifo pulled;        /* waits for pull() */
    struct sqreader *readers;
    int is_closed, error;
};

/* New queue without driver, NULL when out of memory. */
struct serialqueue *serialqueue__new(struct hostclock *clock,
                                     const struct sqdriver *driver);
/* Show what the core received to the readers, then to pull().  Call with the
 * lock held; it is released meanwhile. */
void serialqueue__deliver(struct serialqueue *sq);
/* Note the first failure of the link (lock held). */
void serialqueue__note_error(struct serialqueue *sq, int error);

#endif
