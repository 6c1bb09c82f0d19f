/* SPDX-License-Identifier: GPL-3.0-or-later
 * The serial queue without its drivers.  See serialqueue.h. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "serialqueue.h"
#include "serialqueue_internal.h"

struct serialqueue *
serialqueue__new(struct hostclock *clock, const struct sqdriver *driver)
{
    struct serialqueue *sq = calloc(1, sizeof(*sq));

    if (!sq)
        return NULL;
    if (sqcore_init(&sq->core)) {
        free(sq);
        return NULL;
    }
    sq->clock = clock;
    sq->driver = driver;
    pthread_mutex_init(&sq->lock, NULL);
    pthread_mutex_init(&sq->reader_lock, NULL);
    pthread_cond_init(&sq->arrived, NULL);
    return sq;
}

int
serialqueue_close(struct serialqueue *sq)
{
    int was_closed, error;

    pthread_mutex_lock(&sq->lock);
    was_closed = sq->is_closed;
    sq->is_closed = 1;
    if (!was_closed)
        sq->driver->kick(sq);
    pthread_mutex_unlock(&sq->lock);
    if (!was_closed)
        sq->driver->stop(sq);
    pthread_mutex_lock(&sq->lock);
    error = sq->error;
    pthread_cond_broadcast(&sq->arrived);
    pthread_mutex_unlock(&sq->lock);
    return error;
}

void
serialqueue_free(struct serialqueue *sq)
{
    if (!sq)
        return;
    serialqueue_close(sq);
    qfifo_clear(&sq->pulled);
    sqcore_free(&sq->core);
    pthread_cond_destroy(&sq->arrived);
    pthread_mutex_destroy(&sq->reader_lock);
    pthread_mutex_destroy(&sq->lock);
    free(sq);
}

static void
sink_batch(void *ctx, struct qfifo *batch)
{
    struct cmdqueue *cq = ctx;

    serialqueue_send_batch(cq->owner, cq, batch);
}

struct cmdqueue *
serialqueue_add_queue(struct serialqueue *sq)
{
    struct cmdqueue *cq;

    pthread_mutex_lock(&sq->lock);
    cq = cmdsched_add_queue(&sq->core.sched);
    pthread_mutex_unlock(&sq->lock);
    if (!cq)
        return NULL;
    cq->owner = sq;
    cq->sink.ctx = cq;
    cq->sink.send_batch = sink_batch;
    return cq;
}

void
serialqueue_send_batch(struct serialqueue *sq, struct cmdqueue *cq,
                       struct qfifo *batch)
{
    if (qfifo_is_empty(batch))
        return;
    pthread_mutex_lock(&sq->lock);
    if (sq->is_closed) {
        qfifo_clear(batch);
    } else {
        cmdsched_push(&sq->core.sched, cq, batch);
        sq->driver->kick(sq);
    }
    pthread_mutex_unlock(&sq->lock);
}

int
serialqueue_send(struct serialqueue *sq, struct cmdqueue *cq,
                 const uint8_t *data, size_t len, uint64_t min_clock,
                 uint64_t req_clock, uint64_t notify_id)
{
    struct qfifo batch;
    struct qmsg *m;

    if (!len || len > MSGBLOCK_PAYLOAD_MAX)
        return -EINVAL;
    m = qmsg_new();
    if (!m)
        return -ENOMEM;
    m->len = (uint8_t)len;
    memcpy(m->data, data, len);
    m->min_clock = min_clock;
    m->req_clock = req_clock;
    m->notify_id = notify_id;
    qfifo_init(&batch);
    qfifo_push(&batch, m);
    serialqueue_send_batch(sq, cq, &batch);
    return 0;
}

struct qmsg *
serialqueue_pull(struct serialqueue *sq, int wait)
{
    struct qmsg *m;

    pthread_mutex_lock(&sq->lock);
    while (wait && qfifo_is_empty(&sq->pulled) && !sq->is_closed
           && !sq->error)
        pthread_cond_wait(&sq->arrived, &sq->lock);
    m = sq->is_closed ? NULL : qfifo_pop(&sq->pulled);
    pthread_mutex_unlock(&sq->lock);
    return m;
}

int
serialqueue_has_input(struct serialqueue *sq)
{
    int has_input;

    pthread_mutex_lock(&sq->lock);
    has_input = !qfifo_is_empty(&sq->pulled);
    pthread_mutex_unlock(&sq->lock);
    return has_input;
}

void
serialqueue_add_reader(struct serialqueue *sq, struct sqreader *r)
{
    pthread_mutex_lock(&sq->reader_lock);
    r->next = sq->readers;
    sq->readers = r;
    pthread_mutex_unlock(&sq->reader_lock);
}

void
serialqueue_remove_reader(struct serialqueue *sq, struct sqreader *r)
{
    pthread_mutex_lock(&sq->reader_lock);
    for (struct sqreader **p = &sq->readers; *p; p = &(*p)->next) {
        if (*p == r) {
            *p = r->next;
            break;
        }
    }
    pthread_mutex_unlock(&sq->reader_lock);
}

static void
show_to_readers(struct serialqueue *sq, const struct qmsg *m)
{
    for (struct sqreader *r = sq->readers; r; r = r->next)
        if (m->len >= r->prefix_len
            && !memcmp(m->data, r->prefix, r->prefix_len))
            r->handle(r->ctx, m);
}

void
serialqueue__deliver(struct serialqueue *sq)
{
    struct qfifo fresh;

    if (qfifo_is_empty(&sq->core.inbox))
        return;
    qfifo_init(&fresh);
    qfifo_join(&fresh, &sq->core.inbox);
    pthread_mutex_unlock(&sq->lock);
    pthread_mutex_lock(&sq->reader_lock);
    for (const struct qmsg *m = fresh.head; m; m = m->next)
        if (m->len)
            show_to_readers(sq, m);
    pthread_mutex_unlock(&sq->reader_lock);
    pthread_mutex_lock(&sq->lock);
    qfifo_join(&sq->pulled, &fresh);
    pthread_cond_broadcast(&sq->arrived);
}

void
serialqueue__note_error(struct serialqueue *sq, int error)
{
    if (sq->error)
        return;
    sq->error = error;
    pthread_cond_broadcast(&sq->arrived);
}

void
serialqueue_set_byte_time(struct serialqueue *sq, double byte_time)
{
    pthread_mutex_lock(&sq->lock);
    sq->core.byte_time = byte_time;
    pthread_mutex_unlock(&sq->lock);
}

void
serialqueue_set_receive_window(struct serialqueue *sq, uint32_t bytes)
{
    pthread_mutex_lock(&sq->lock);
    sq->core.receive_window = bytes;
    pthread_mutex_unlock(&sq->lock);
}

void
serialqueue_set_clockest(struct serialqueue *sq, const struct clockest *ce)
{
    pthread_mutex_lock(&sq->lock);
    sq->core.clockest = *ce;
    sq->driver->kick(sq);
    pthread_mutex_unlock(&sq->lock);
}

void
serialqueue_get_clockest(struct serialqueue *sq, struct clockest *ce)
{
    pthread_mutex_lock(&sq->lock);
    *ce = sq->core.clockest;
    pthread_mutex_unlock(&sq->lock);
}

void
serialqueue_get_stats(struct serialqueue *sq, struct sqstats *stats)
{
    pthread_mutex_lock(&sq->lock);
    sqcore_get_stats(&sq->core, stats);
    pthread_mutex_unlock(&sq->lock);
}

static size_t
copy_history(const struct sqhistory *h, struct sqrecord *out)
{
    uint64_t first = h->count > SQCORE_HISTORY ? h->count - SQCORE_HISTORY : 0;

    for (uint64_t i = first; i < h->count; i++)
        *out++ = h->records[i % SQCORE_HISTORY];
    return (size_t)(h->count - first);
}

void
serialqueue_get_history(struct serialqueue *sq, struct sqrecord *sent,
                        size_t *n_sent, struct sqrecord *received,
                        size_t *n_received)
{
    pthread_mutex_lock(&sq->lock);
    *n_sent = copy_history(&sq->core.sent, sent);
    *n_received = copy_history(&sq->core.received, received);
    pthread_mutex_unlock(&sq->lock);
}

int
serialqueue_get_error(struct serialqueue *sq)
{
    int error;

    pthread_mutex_lock(&sq->lock);
    error = sq->error;
    pthread_mutex_unlock(&sq->lock);
    return error;
}

int
serialqueue_check(struct serialqueue *sq)
{
    int ret;

    pthread_mutex_lock(&sq->lock);
    ret = sqcore_check(&sq->core);
    if (!ret)
        ret = qfifo_check(&sq->pulled);
    pthread_mutex_unlock(&sq->lock);
    return ret;
}
