/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A planner and a guard that share steps: thousands of times the planner goes
 * away and comes back at once, while the guard's thread is at work.  At the
 * end it stays away.  All steps must be there.  Usage: guard_threads [rounds].
 */
#include <math.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>

#include "kin_delta.h"
#include "kin_linear.h"
#include "motionlock.h"
#include "stepguard.h"

enum { MOTORS = 3 };

#define FREQ 16e6
#define STEP .01
#define SPEED 40.

struct machine {
    struct trapq *tq;
    struct steppersync *ss;
    struct stepcompress *sc[MOTORS];
    struct itersolve *is[MOTORS];
    struct stepguard *guard;
    double time, position[3], reached;
    long messages, taken_over;
};

static void
expect(int is_true, const char *what)
{
    if (is_true)
        return;
    fprintf(stderr, "not so: %s\n", what);
    exit(1);
}

static void
count_messages(void *ctx, struct qfifo *batch)
{
    struct machine *m = ctx;
    struct qmsg *msg;

    while ((msg = qfifo_pop(batch)) != NULL) {
        m->messages++;
        qmsg_free(msg);
    }
}

static void
build(struct machine *m)
{
    struct qsink sink = { m, count_messages };
    struct stepcompress_options options = { 400, 5, 6, 0 };

    m->tq = trapq_new();
    m->ss = steppersync_new(&sink, 100);
    m->is[0] = &kin_linear_new(1., 1., 0.)->is;
    m->is[1] = &kin_linear_new(1., -1., 0.)->is;
    m->is[2] = &kin_delta_new(250. * 250., 130., 0.)->is;
    steppersync_set_time(m->ss, 0., FREQ);
    for (int i = 0; i < MOTORS; i++) {
        m->sc[i] = stepcompress_new((uint32_t)i);
        stepcompress_configure(m->sc[i], &options);
        itersolve_set_trapq(m->is[i], m->tq);
        itersolve_set_stepcompress(m->is[i], m->sc[i], STEP);
        itersolve_set_position(m->is[i], m->position);
        steppersync_add(m->ss, m->sc[i], m->is[i]);
    }
    m->guard = stepguard_new(hostclock_get_real());
    expect(m->guard && !stepguard_add(m->guard, m->ss)
           && !stepguard_start(m->guard), "there is a guard");
}

/* A round, as one arc, or there and back along a line. */
static void
add_move(struct machine *m, int i)
{
    double radius = 1. + i % 5, way = 2. * 3.14159265358979323846 * radius;
    struct trap_move move = {
        .cruise_t = way / SPEED, .axes_r = { 1., 0., 0. },
        .start_v = SPEED, .cruise_v = SPEED, .turn = 1. / radius,
        .normal = 2,
    };

    if (i % 2) {
        move.turn = 0.;
        move.axes_r[0] = i % 4 == 1 ? .01 : -.01;
    }
    for (int k = 0; k < 3; k++)
        move.start[k] = m->position[k];
    if (i % 2)
        m->position[0] += way * move.axes_r[0];
    motionlock_take();
    expect(!trapq_add(m->tq, m->time, &move), "there is memory");
    m->time = m->tq->end_time;
    motionlock_give();
}

static void
make_steps(struct machine *m, double until)
{
    motionlock_take();
    expect(!steppersync_generate(m->ss, until), "steps are made");
    expect(!steppersync_flush_until(m->ss, until), "steps are sent");
    trapq_finalize(m->tq, until - 1., until - 2.);
    motionlock_give();
    m->reached = until;
}

/* Let the guard go on from here, as if it was time for that. */
static void
go_away(struct machine *m)
{
    double now = hostclock_now(hostclock_get_real());
    struct stepguard_plan plan = {
        .reached = m->reached, .certain = m->time - .1, .end = m->time,
        .deadline = now - 10., .slack = 1e6,
    };

    if (plan.end > plan.reached)
        stepguard_arm(m->guard, &plan);
}

static void
come_back(struct machine *m)
{
    struct stepguard_result result = stepguard_disarm(m->guard);

    if (!result.is_armed)
        return;
    expect(!result.error, "the guard makes steps");
    m->taken_over += result.reached > m->reached;
    m->reached = fmax(m->reached, result.reached);
}

static void
check_end(struct machine *m)
{
    expect(!steppersync_check(m->ss) && !trapq_check(m->tq)
           && !stepguard_check(m->guard), "all holds");
    for (int i = 0; i < MOTORS; i++) {
        double there = itersolve_calc_position(m->is[i], m->position);
        double is_at = itersolve_get_commanded_pos(m->is[i]);
        expect(fabs(there - is_at) <= .5 * STEP + 1e-6, "no step is lost");
    }
}

static void
destroy(struct machine *m)
{
    stepguard_free(m->guard);
    steppersync_delete(m->ss);
    for (int i = 0; i < MOTORS; i++) {
        stepcompress_delete(m->sc[i]);
        free(m->is[i]);
    }
    trapq_delete(m->tq);
}

int
main(int argc, char **argv)
{
    struct machine m = { .time = 1. };
    int rounds = argc > 1 ? atoi(argv[1]) : 1000;

    build(&m);
    for (int i = 0; i < rounds; i++) {
        add_move(&m, i);
        if (i % 3 == 0 && m.time - .2 > m.reached)
            make_steps(&m, m.time - .2);
        go_away(&m);
        for (int k = 0; k < i % 7; k++)
            sched_yield();
        come_back(&m);
    }
    while (m.reached < m.time) {
        go_away(&m);
        sched_yield();
        come_back(&m);
    }
    check_end(&m);
    printf("%d rounds, %ld messages, guarded %ld times\n", rounds, m.messages,
           m.taken_over);
    expect(m.taken_over > 0, "the guard was needed");
    destroy(&m);
    return 0;
}
