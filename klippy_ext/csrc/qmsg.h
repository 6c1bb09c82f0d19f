/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Encoded commands on their way to a micro-controller.
 *
 * A qmsg holds the payload bytes of one command and the two clocks that order
 * it: it must not reach the mcu before min_clock and should be there by
 * req_clock (both in ticks of the target mcu, 64 bit).  Chains of qmsg are
 * handed over whole: who calls qsink.send_batch() gives the messages away.
 *
 * Whoever makes many takes them of a qpool, a few dozen an allocation.
 *
 * Threads: a qfifo and a qpool have one owner at a time; nothing here locks.
 * Messages of a pool may be freed by any thread, and after the pool.
 */
#ifndef QMSG_H
#define QMSG_H

#include <stddef.h>
#include <stdint.h>

enum { QMSG_DATA_MAX = 59 };    /* payload of a full 64 byte block */

/* req_clock of a message that only fills otherwise idle wire time */
#define QMSG_BACKGROUND_CLOCK UINT64_C(0x7fffffff00000000)

struct qmsg {
    struct qmsg *next;
    struct qslab *slab;         /* that it is a part of; NULL: of none */
    uint64_t min_clock, req_clock;
    uint64_t notify_id;         /* 0: nobody waits for the ack */
    double sent_time, receive_time;     /* s, host clock */
    uint8_t len;
    uint8_t data[64];
};

struct qpool {
    struct qslab *slab;         /* NULL, or one with some that are not used */
    int n_used;                 /* messages of it */
};

struct qfifo {
    struct qmsg *head, *tail;
};

/* Taker of message chains; must empty the fifo, must not fail. */
struct qsink {
    void *ctx;
    void (*send_batch)(void *ctx, struct qfifo *batch);
};

/* Return a zeroed message, or NULL when out of memory. */
struct qmsg *qmsg_new(void);
void qmsg_free(struct qmsg *m);

/* As qmsg_new(), but for its data, which is not zeroed. */
struct qmsg *qpool_new(struct qpool *p);
/* Empty it; its messages stay. */
void qpool_clear(struct qpool *p);

static inline void
qfifo_init(struct qfifo *f)
{
    f->head = f->tail = NULL;
}

static inline int
qfifo_is_empty(const struct qfifo *f)
{
    return f->head == NULL;
}

static inline void
qfifo_push(struct qfifo *f, struct qmsg *m)
{
    m->next = NULL;
    if (f->tail)
        f->tail->next = m;
    else
        f->head = m;
    f->tail = m;
}

static inline struct qmsg *
qfifo_pop(struct qfifo *f)
{
    struct qmsg *m = f->head;
    if (!m)
        return NULL;
    f->head = m->next;
    if (!f->head)
        f->tail = NULL;
    m->next = NULL;
    return m;
}

/* Append all of src to dst and empty src. */
static inline void
qfifo_join(struct qfifo *dst, struct qfifo *src)
{
    if (!src->head)
        return;
    if (dst->tail)
        dst->tail->next = src->head;
    else
        dst->head = src->head;
    dst->tail = src->tail;
    qfifo_init(src);
}

/* Free every message of the fifo. */
void qfifo_clear(struct qfifo *f);
/* 0, or a negative number that says which invariant does not hold. */
int qfifo_check(const struct qfifo *f);

#endif
