/* SPDX-License-Identifier: GPL-3.0-or-later
 * A world with everything in it, built up, run and taken down, for the memory
 * sanitizers.  Argument: the toy mcu's library. */
#include <stdio.h>
#include <stdlib.h>

#include "clockest.h"
#include "serialqueue.h"
#include "vworld.h"

enum { N_MCUS = 3, N_ROUNDS = 200 };

struct side {
    struct vmcu *mcu;
    struct serialqueue *sq;
    struct cmdqueue *cq;
    struct vstep *step;
    struct voutput *output;
    uint32_t n_acked;
};

static void
check(int is_true, const char *what)
{
    if (is_true)
        return;
    fprintf(stderr, "%s\n", what);
    abort();
}

static void
open_side(struct vworld *w, struct side *s, const char *library, int index)
{
    struct vmcu_options options = {
        .name = "toy", .library = library, .ppm = 10. * index,
        .baud = 250000., .latency = 0.0002, .seed = vworld_make_seed(w),
    };

    s->mcu = vworld_add_mcu(w, &options);
    check(s->mcu != NULL, vworld_get_error(w));
    s->sq = serialqueue_open_virtual(vworld_get_clock(w), &s->mcu->link);
    s->cq = serialqueue_add_queue(s->sq);
    s->step = vpins_watch_step(&s->mcu->pins, 2, 3, 0, 0, 0);
    s->step->is_recording = 1;
    s->output = vpins_watch_output(&s->mcu->pins, 2, 1, 0);
    vlink_record(&s->mcu->link, 1);
    vlink_set_faults(&s->mcu->link, &(struct vlink_faults) {
        .flip = 0.002, .drop = 0.002, .insert = 0.002, .twice = 0.002 });
}

/* Log some bytes; toggle pin 2 twenty times; ask for the log. */
static void
send_round(struct side *s, int round)
{
    const uint8_t log[] = { 1, 3, 'a', 'b', (uint8_t)round };
    const uint8_t toggle[] = { 4, 2, 20, 50 }, ask[] = { 9 };

    check(!serialqueue_send(s->sq, s->cq, log, sizeof(log), 0, 0,
                            1 + (uint64_t)round), "log not sent");
    check(!serialqueue_send(s->sq, s->cq, toggle, sizeof(toggle), 0, 0, 0),
          "toggle not sent");
    check(!serialqueue_send(s->sq, s->cq, ask, sizeof(ask), 0, 0, 0),
          "question not sent");
}

static void
pull_all(struct side *s)
{
    struct qmsg *m;

    while ((m = serialqueue_pull(s->sq, 0)) != NULL) {
        s->n_acked += m->notify_id != 0;
        qmsg_free(m);
    }
    check(!serialqueue_check(s->sq), "queue is inconsistent");
    check(!vmcu_check(s->mcu), "mcu is inconsistent");
}

static void
run_until(struct vworld *w, struct side *sides, double limit)
{
    while (vworld_get_now(w) < limit) {
        check(vworld_run(w, limit) != VWORLD_ERROR, vworld_get_error(w));
        for (int i = 0; i < N_MCUS; i++)
            pull_all(&sides[i]);
    }
}

/* Checks tell what is broken: each number here is put back. */
static void
break_things(struct vworld *w, struct side *s)
{
    struct vmcu *m = s->mcu;
    struct hostclock *clock = vworld_get_clock(w);
    struct hostclock kept = *clock;
    struct clockest estimate = { 1e6, 1., 5, 5 };
    double rate = m->rate, latency = m->link.latency;

    m->rate = 0.;
    check(vworld_check(w) && vmcu_check(m), "an mcu without a clock");
    m->rate = rate;
    m->link.latency = -1.;
    check(vlink_check(&m->link) && vworld_check(w), "a link into the past");
    m->link.latency = latency;
    s->step->position++;
    check(vpins_check(&m->pins) && vworld_check(w), "a step not counted");
    s->step->position--;
    s->output->fraction = 1.5;
    check(vpins_check(&m->pins), "an output on for more than always");
    s->output->fraction = 0.;
    clock->read = NULL;
    check(hostclock_check(clock) && vworld_check(w), "a clock without time");
    *clock = kept;
    check(!hostclock_check(hostclock_get_real()), "the real clock");
    check(!clockest_check(&estimate), "an estimate");
    estimate.freq = -1.;
    check(clockest_check(&estimate), "an estimate that runs back");
    check(!vworld_check(w), "all is put back");
}

int
main(int argc, char **argv)
{
    struct vworld *w = vworld_new(7);
    struct side sides[N_MCUS] = { 0 };
    double coeffs[N_MCUS] = { 1., 1., 1. };
    struct vstep *steps[N_MCUS];

    check(argc > 1, "no library given");
    vworld_add_ticker(w, 0.01);
    for (int i = 0; i < N_MCUS; i++) {
        open_side(w, &sides[i], argv[1], i);
        steps[i] = sides[i].step;
    }
    check(!vpins_bind_switch(&sides[0].mcu->pins, 5, steps, coeffs, N_MCUS,
                             10., 1, 0), "switch not bound");
    vworld_limit_slice(w, 20e-6);
    for (int round = 0; round < N_ROUNDS; round++) {
        for (int i = 0; i < N_MCUS; i++)
            send_round(&sides[i], round);
        run_until(w, sides, vworld_get_now(w) + 0.004);
        check(!vworld_check(w), "world is inconsistent");
    }
    run_until(w, sides, vworld_get_now(w) + 60.);
    for (int i = 0; i < N_MCUS; i++) {
        check(sides[i].n_acked == N_ROUNDS, "not all acknowledged");
        check(sides[i].step->position < -100, "no steps");
        check(!vmcu_reset(sides[i].mcu, vworld_get_now(w)), "no reset");
    }
    check(!vworld_check(w), "world is inconsistent after resets");
    break_things(w, &sides[0]);
    printf("%d mcus, %.1f s\n", N_MCUS, vworld_get_now(w));
    for (int i = 0; i < N_MCUS; i++)
        serialqueue_free(sides[i].sq);
    vworld_free(w);
    return 0;
}
