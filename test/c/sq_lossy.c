/* SPDX-License-Identifier: GPL-3.0-or-later
 * The protocol core against a toy mcu over a link that damages bytes, in
 * made-up time: every message arrives once and in order, invariants hold after
 * every event.  Argument: number of runs. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sqcore.h"
#include "vlink.h"
#include "vrandom.h"

enum { N_QUEUES = 3, N_MESSAGES = 300, MCU_BUF = 192 };

struct mcu {
    uint8_t buf[MCU_BUF];
    size_t len;
    uint8_t expected;
    uint32_t next[N_QUEUES], n_got;
};

struct run {
    struct sqcore core;
    struct vlink link;
    struct mcu mcu;
    struct cmdqueue *queues[N_QUEUES];
    uint64_t rng;
    double now, wake;
    uint32_t n_done, n_sent;
};

static void
check(int is_true, const char *what, const struct run *r)
{
    if (is_true)
        return;
    fprintf(stderr, "%s at %.6f\n", what, r->now);
    abort();
}

static void
answer(struct run *r)
{
    uint8_t block[MSGBLOCK_MAX];
    size_t len = msgblock_build(block, r->mcu.expected, NULL, 0);

    vlink_write(&r->link, VLINK_FROM_MCU, r->now, block, len);
}

/* Messages are: queue, number (VLQ), filler length, filler. */
static void
take_payload(struct run *r, const uint8_t *p, const uint8_t *end)
{
    while (p < end) {
        uint32_t queue = *p++, number;
        check(queue < N_QUEUES, "bad queue", r);
        check(!msgblock_get_int(&p, end, &number), "cut message", r);
        check(number == r->mcu.next[queue]++, "out of order", r);
        p += *p + 1;
        r->mcu.n_got++;
    }
    check(p == end, "message over the end", r);
}

static void
take_block(struct run *r, const uint8_t *block, int len)
{
    struct mcu *m = &r->mcu;

    if ((block[1] & MSGBLOCK_SEQ_MASK) == m->expected) {
        m->expected = (m->expected + 1) & MSGBLOCK_SEQ_MASK;
        take_payload(r, block + MSGBLOCK_HEADER,
                     block + len - MSGBLOCK_TRAILER);
    }
    answer(r);
}

static void
deliver_to_mcu(struct run *r)
{
    struct vchunk *chunk = vlink_take(&r->link, VLINK_TO_MCU);
    struct mcu *m = &r->mcu;
    int found;

    for (size_t i = 0; i < chunk->len; i++) {
        if (m->len == MCU_BUF)
            m->len = 0;
        m->buf[m->len++] = chunk->data[i];
        while ((found = msgblock_check(m->buf, m->len)) != 0) {
            size_t size = (size_t)abs(found);
            if (found > 0)
                take_block(r, m->buf, found);
            else if (found < -1)
                answer(r);
            m->len -= size;
            memmove(m->buf, m->buf + size, m->len);
        }
    }
    free(chunk);
}

static void
deliver_to_host(struct run *r)
{
    struct vchunk *chunk = vlink_take(&r->link, VLINK_FROM_MCU);
    struct qmsg *m;

    sqcore_input(&r->core, r->now, chunk->data, chunk->len);
    free(chunk);
    while ((m = qfifo_pop(&r->core.inbox)) != NULL) {
        check(!m->len && m->notify_id > 0, "not a completion", r);
        r->n_done++;
        qmsg_free(m);
    }
    r->wake = r->now;
}

static void
queue_message(struct run *r, uint32_t queue, uint32_t number)
{
    struct qmsg *m = qmsg_new();
    struct qfifo batch = { NULL, NULL };
    uint8_t *p = m->data;

    *p++ = (uint8_t)queue;
    p = msgblock_put_int(p, number);
    *p = (uint8_t)(vrandom_next(&r->rng) % 50);
    m->len = (uint8_t)(p + 1 + *p - m->data);
    m->min_clock = (uint64_t)(r->now * 1e6)
        + vrandom_next(&r->rng) % 2000000;
    m->req_clock = vrandom_next(&r->rng) % 4
        ? m->min_clock : QMSG_BACKGROUND_CLOCK;
    m->notify_id = 1 + number;
    qfifo_push(&batch, m);
    cmdsched_push(&r->core.sched, r->queues[queue], &batch);
    r->n_sent++;
}

static void
step(struct run *r)
{
    double to_mcu = vlink_get_arrival(&r->link, VLINK_TO_MCU);
    double to_host = vlink_get_arrival(&r->link, VLINK_FROM_MCU);
    double next = fmin(fmin(to_mcu, to_host), r->wake);

    if (next == INFINITY) {
        check(r->n_done == r->n_sent, "nothing will happen any more", r);
        return;
    }
    r->now = fmax(r->now, next);
    if (to_mcu <= r->now)
        deliver_to_mcu(r);
    else if (to_host <= r->now)
        deliver_to_host(r);
    else {
        r->wake = sqcore_run(&r->core, r->now);
        check(r->wake > r->now, "no progress", r);
        vlink_write(&r->link, VLINK_TO_MCU, r->now, r->core.out,
                    r->core.out_len);
        r->core.out_len = 0;
    }
    check(!sqcore_check(&r->core), "broken invariant", r);
}

static void
init_run(struct run *r, uint64_t seed)
{
    double rate;

    memset(r, 0, sizeof(*r));
    r->rng = seed;
    rate = 0.01 * vrandom_unit(&r->rng);
    check(!sqcore_init(&r->core), "no memory", r);
    vlink_init(&r->link, 250000., 0.001 * vrandom_unit(&r->rng), seed,
               &r->now);
    vlink_set_faults(&r->link, &(struct vlink_faults) {
        .flip = rate, .drop = rate / 2, .insert = rate / 2,
        .twice = rate / 2 });
    r->mcu.expected = (uint8_t)(seed & 15);
    r->core.clockest = (struct clockest) { .freq = 1e6 };
    r->core.receive_window = seed & 1 ? MCU_BUF : 0;
    r->core.byte_time = seed & 2 ? 10. / 250000. : 0.;
    for (int i = 0; i < N_QUEUES; i++)
        r->queues[i] = cmdsched_add_queue(&r->core.sched);
}

static void
run_seed(uint64_t seed)
{
    static struct run r;
    uint32_t sent[N_QUEUES] = { 0 };

    init_run(&r, seed);
    for (int i = 0; i < N_MESSAGES; i++) {
        uint32_t queue = (uint32_t)(vrandom_next(&r.rng) % N_QUEUES);
        queue_message(&r, queue, sent[queue]++);
        r.wake = r.now;
        for (uint64_t n = vrandom_next(&r.rng) % 8; n; n--)
            step(&r);
    }
    while (r.n_done < N_MESSAGES) {
        check(r.now < 3600., "not everything arrives", &r);
        step(&r);
    }
    check(r.mcu.n_got == N_MESSAGES, "wrong count", &r);
    for (int i = 0; i < N_QUEUES; i++)
        check(r.mcu.next[i] == sent[i], "wrong count of a queue", &r);
    sqcore_free(&r.core);
    vlink_free(&r.link);
}

int
main(int argc, char **argv)
{
    int n_runs = argc > 1 ? atoi(argv[1]) : 100;

    for (int i = 0; i < n_runs; i++)
        run_seed((uint64_t)i);
    printf("%d runs of %d messages\n", n_runs, N_MESSAGES);
    return 0;
}
