/* SPDX-License-Identifier: GPL-3.0-or-later
 * Waiting messages and their order.  See cmdqueue.h. */
#include <stdlib.h>
#include <string.h>

#include "cmdqueue.h"

enum { CLOCK_REACH = INT32_MAX };

void
cmdsched_init(struct cmdsched *s)
{
    memset(s, 0, sizeof(*s));
    s->next_release = UINT64_MAX;
}

void
cmdsched_free(struct cmdsched *s)
{
    for (int i = 0; i < s->n_queues; i++) {
        qfifo_clear(&s->queues[i]->upcoming);
        qfifo_clear(&s->queues[i]->ready);
        free(s->queues[i]);
    }
    free(s->queues);
    cmdsched_init(s);
}

struct cmdqueue *
cmdsched_add_queue(struct cmdsched *s)
{
    size_t count = (size_t)s->n_queues + 1;
    struct cmdqueue **grown;
    struct cmdqueue *cq = calloc(1, sizeof(*cq));

    if (!cq)
        return NULL;
    grown = realloc(s->queues, count * sizeof(*grown));
    if (!grown) {
        free(cq);
        return NULL;
    }
    s->queues = grown;
    s->queues[s->n_queues++] = cq;
    cq->urgent_clock = UINT64_MAX;
    cq->is_sorted = 1;
    return cq;
}

static void
note_release(struct cmdsched *s, const struct cmdqueue *cq)
{
    const struct qmsg *head = cq->upcoming.head;

    if (head && head->min_clock < s->next_release)
        s->next_release = head->min_clock;
}

void
cmdsched_push(struct cmdsched *s, struct cmdqueue *cq, struct qfifo *batch)
{
    for (struct qmsg *m = batch->head; m; m = m->next) {
        s->upcoming_bytes += m->len;
        if (m->req_clock < QMSG_BACKGROUND_CLOCK
            && m->req_clock > m->min_clock + CLOCK_REACH)
            m->min_clock = m->req_clock - CLOCK_REACH;
    }
    qfifo_join(&cq->upcoming, batch);
    note_release(s, cq);
}

static void
make_ready(struct cmdsched *s, struct cmdqueue *cq)
{
    struct qmsg *m = qfifo_pop(&cq->upcoming);

    if (qfifo_is_empty(&cq->ready)) {
        cq->is_sorted = 1;
        cq->urgent_clock = m->req_clock;
    } else if (m->req_clock < cq->last_clock) {
        cq->is_sorted = 0;
        if (m->req_clock < cq->urgent_clock)
            cq->urgent_clock = m->req_clock;
    }
    cq->last_clock = m->req_clock;
    qfifo_push(&cq->ready, m);
    s->upcoming_bytes -= m->len;
    s->ready_bytes += m->len;
}

void
cmdsched_release(struct cmdsched *s, uint64_t clock)
{
    if (clock < s->next_release)
        return;
    s->next_release = UINT64_MAX;
    for (int i = 0; i < s->n_queues; i++) {
        struct cmdqueue *cq = s->queues[i];
        while (cq->upcoming.head && cq->upcoming.head->min_clock <= clock)
            make_ready(s, cq);
        note_release(s, cq);
    }
}

static struct cmdqueue *
find_urgent(const struct cmdsched *s)
{
    struct cmdqueue *best = NULL;

    for (int i = 0; i < s->n_queues; i++) {
        struct cmdqueue *cq = s->queues[i];
        if (!cq->ready.head)
            continue;
        if (!best || cq->urgent_clock < best->urgent_clock)
            best = cq;
    }
    return best;
}

uint64_t
cmdsched_get_urgent(const struct cmdsched *s)
{
    const struct cmdqueue *cq = s->ready_bytes ? find_urgent(s) : NULL;

    return cq ? cq->urgent_clock : UINT64_MAX;
}

uint32_t
cmdsched_fill(struct cmdsched *s, uint8_t *payload, uint32_t room,
              struct qfifo *waited)
{
    uint32_t used = 0;
    struct cmdqueue *cq;

    while ((cq = find_urgent(s)) != NULL
           && used + cq->ready.head->len <= room) {
        struct qmsg *m = qfifo_pop(&cq->ready);
        memcpy(payload + used, m->data, m->len);
        used += m->len;
        s->ready_bytes -= m->len;
        if (cq->is_sorted && cq->ready.head)
            cq->urgent_clock = cq->ready.head->req_clock;
        if (m->notify_id)
            qfifo_push(waited, m);
        else
            qmsg_free(m);
    }
    return used;
}

static uint32_t
sum_bytes(const struct qfifo *f)
{
    uint32_t sum = 0;

    for (const struct qmsg *m = f->head; m; m = m->next)
        sum += m->len;
    return sum;
}

int
cmdsched_check(const struct cmdsched *s)
{
    uint32_t upcoming = 0, ready = 0;

    for (int i = 0; i < s->n_queues; i++) {
        const struct cmdqueue *cq = s->queues[i];
        upcoming += sum_bytes(&cq->upcoming);
        ready += sum_bytes(&cq->ready);
        for (const struct qmsg *m = cq->ready.head; m; m = m->next)
            if (m->req_clock < cq->urgent_clock)
                return -1;
        if (cq->upcoming.head
            && cq->upcoming.head->min_clock < s->next_release)
            return -2;
    }
    return upcoming == s->upcoming_bytes && ready == s->ready_bytes ? 0 : -3;
}
