/* SPDX-License-Identifier: GPL-3.0-or-later
 * Memory of encoded commands.  See qmsg.h. */
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "qmsg.h"

/* One where the sanitizer shall see each message by itself. */
#ifndef QMSG_SLAB
#ifdef __SANITIZE_ADDRESS__
#define QMSG_SLAB 1
#else
#define QMSG_SLAB 32
#endif
#endif

struct qslab {
    atomic_int n_left;          /* messages that are not freed */
    struct qmsg messages[QMSG_SLAB];
};

struct qmsg *
qmsg_new(void)
{
    return calloc(1, sizeof(struct qmsg));
}

/* Count n messages of a slab off; the last one takes it along. */
static void
leave(struct qslab *slab, int n)
{
    if (atomic_fetch_sub_explicit(&slab->n_left, n, memory_order_acq_rel) == n)
        free(slab);
}

void
qmsg_free(struct qmsg *m)
{
    if (m && m->slab)
        leave(m->slab, 1);
    else
        free(m);
}

struct qmsg *
qpool_new(struct qpool *p)
{
    struct qmsg *m;

    if (!p->slab) {
        p->slab = malloc(sizeof(*p->slab));
        if (!p->slab)
            return NULL;
        atomic_init(&p->slab->n_left, QMSG_SLAB);
        p->n_used = 0;
    }
    m = &p->slab->messages[p->n_used++];
    memset(m, 0, offsetof(struct qmsg, data));
    m->slab = p->slab;
    if (p->n_used == QMSG_SLAB)
        p->slab = NULL;
    return m;
}

void
qpool_clear(struct qpool *p)
{
    if (p->slab)
        leave(p->slab, QMSG_SLAB - p->n_used);
    p->slab = NULL;
}

void
qfifo_clear(struct qfifo *f)
{
    struct qmsg *m;

    while ((m = qfifo_pop(f)) != NULL)
        qmsg_free(m);
}

int
qfifo_check(const struct qfifo *f)
{
    const struct qmsg *last = NULL;

    for (const struct qmsg *m = f->head; m; m = m->next) {
        if (m->len > sizeof(m->data))
            return -72;
        last = m;
    }
    return last == f->tail ? 0 : -73;
}
