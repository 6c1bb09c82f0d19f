/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The I/O half from birth to death, again and again, with the N-th allocation
 * failing: whoever asked is told, or what was lost is sent again; all stays
 * consistent and nothing leaks.  Arguments: the toy mcu's library, and a step
 * for the later allocations.  Built with malloc, calloc and realloc wrapped.
 */
#include <stdio.h>
#include <stdlib.h>

#include "failing_memory.h"
#include "trdispatch.h"
#include "vworld.h"

enum { ROUNDS = 6 };

struct story {
    struct vworld *w;
    struct vmcu *mcu;
    struct serialqueue *sq;
    struct cmdqueue *cq;
    struct trdispatch *td;
    struct trmember *member;
    struct vstep *step;
    unsigned int n_sent, n_acked;
};

/* 0, or -1 if somebody said that there is no memory. */
static int
build(struct story *s, const char *library)
{
    struct vmcu_options options = {
        .name = "toy", .library = library, .baud = 250000., .latency = 0.0002,
    };
    struct trmember_tags tags = { 3, 4, 5, 9 };

    s->w = vworld_new(7);
    if (!s->w || vworld_add_ticker(s->w, .01) < 0)
        return -1;
    s->mcu = vworld_add_mcu(s->w, &options);
    if (!s->mcu)
        return -1;
    s->sq = serialqueue_open_virtual(vworld_get_clock(s->w), &s->mcu->link);
    s->cq = s->sq ? serialqueue_add_queue(s->sq) : NULL;
    s->td = trdispatch_new();
    if (!s->cq || !s->td)
        return -1;
    s->member = trdispatch_add(s->td, s->sq, s->cq, &tags);
    s->step = vpins_watch_step(&s->mcu->pins, 2, 3, 0, 0, 0);
    if (!s->member || !s->step
        || !vpins_watch_output(&s->mcu->pins, 2, 0, 0))
        return -1;
    s->step->is_recording = 1;
    vlink_record(&s->mcu->link, 1);
    return vpins_bind_switch(&s->mcu->pins, 5, &s->step,
                             (const double[]) { 1. }, 1, 10., 1, 0);
}

static void
pull(struct story *s)
{
    struct qmsg *m;

    while ((m = serialqueue_pull(s->sq, 0)) != NULL) {
        s->n_acked += m->notify_id != 0;
        qmsg_free(m);
    }
}

static void
check(struct story *s)
{
    expect(!serialqueue_check(s->sq), "the queue holds");
    expect(!trdispatch_check(s->td), "the dispatcher holds");
    expect(!vworld_check(s->w), "the world holds");
}

static int
run_until(struct story *s, double limit)
{
    while (vworld_get_now(s->w) < limit) {
        if (vworld_run(s->w, limit) == VWORLD_ERROR)
            return -1;
        pull(s);
    }
    check(s);
    return 0;
}

static int
talk(struct story *s)
{
    const uint8_t toggle[] = { 4, 2, 20, 50 }, ask[] = { 9 };

    trdispatch_arm(s->td, 7);
    for (int round = 1; round <= ROUNDS; round++) {
        if (serialqueue_send(s->sq, s->cq, toggle, sizeof(toggle), 0, 0,
                             (uint64_t)round))
            return -1;
        s->n_sent++;
        if (serialqueue_send(s->sq, s->cq, ask, sizeof(ask), 0, 0, 0)
            || run_until(s, vworld_get_now(s->w) + .004))
            return -1;
    }
    return run_until(s, vworld_get_now(s->w) + 2.);
}

static void
destroy(struct story *s)
{
    if (s->td)
        trdispatch_disarm(s->td);
    trdispatch_free(s->td);
    trmember_free(s->member);
    if (s->sq)
        serialqueue_free(s->sq);
    vworld_free(s->w);
}

/* 0, or -1 if somebody was told that there is no memory. */
static int
tell(const char *library)
{
    struct story s = { .w = NULL };
    int ret = build(&s, library);

    ret = ret ? ret : talk(&s);
    if (!ret) {
        expect(s.n_acked == s.n_sent, "what was sent has arrived");
        expect(s.step->position < 0, "there are steps");
        if (vmcu_reset(s.mcu, vworld_get_now(s.w)))
            ret = -1;
        else
            expect(!vworld_check(s.w), "the world holds after a reset");
    }
    destroy(&s);
    return ret;
}

int
main(int argc, char **argv)
{
    long total, told = 0, refused = 0;
    long step = argc > 2 ? atol(argv[2]) : 1;

    expect(argc > 1, "there is a library");
    expect(!tell(argv[1]), "no error");
    total = n_allocs;
    for (failing = 1; failing <= total; failing++) {
        if (failing > 100 && failing % step)
            continue;
        n_allocs = 0;
        refused += tell(argv[1]) != 0;
        told++;
    }
    printf("%ld allocations, %ld made to fail, %ld refused\n", total, told,
           refused);
    return 0;
}
