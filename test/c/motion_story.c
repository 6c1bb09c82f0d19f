/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A short print through the whole motion core, on a linear machine, a delta
 * and an extruder (whose filament is shaped, and cut as the arcs of the head),
 * with homing in between, in one thread and in several:
 * messages are the same.  Usage: motion_story [step]: with a number it is told
 * again and again, and the N-th allocation fails.
 * Built with malloc, calloc and realloc wrapped.
 */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "failing_memory.h"
#include "kin_delta.h"
#include "kin_deltesian.h"
#include "kin_extruder.h"
#include "kin_linear.h"
#include "kin_polar.h"
#include "kin_rotary_delta.h"
#include "kin_winch.h"
#include "shaper.h"
#include "steppersync.h"

enum { STEPPERS = 10, MOVES = 300, MOVE_COUNT = 20 };

#define FREQ 16e6

struct machine {
    struct trapq *tq, *filament;
    struct shaper_path *paths[STEPPERS];
    struct stepcompress *sc[STEPPERS];
    struct itersolve *is[STEPPERS];
    struct steppersync *ss;
    struct steppool *pool;
    int n_threads;              /* of the pool; negative: there is none */
    double time, position[3], pushed;
    uint64_t messages, hash;
};

static void
count_messages(void *ctx, struct qfifo *batch)
{
    struct machine *m = ctx;
    struct qmsg *msg;

    while ((msg = qfifo_pop(batch)) != NULL) {
        m->messages++;
        for (int i = 0; i < msg->len; i++)
            m->hash = (m->hash ^ msg->data[i]) * UINT64_C(0x100000001b3);
        m->hash ^= msg->req_clock ^ msg->min_clock << 20;
        qmsg_free(msg);
    }
}

static void
make_kinematics(struct machine *m)
{
    struct kin_linear *a = kin_linear_new(1., 1., 0.);
    struct kin_linear *b = kin_linear_new(0., 0., 1.);
    struct kin_delta *c = kin_delta_new(250. * 250., 130., 0.);
    struct kin_delta *d = kin_delta_new(250. * 250., -65., 112.);
    struct kin_extruder *e = kin_extruder_new();
    struct kin_winch *f = kin_winch_new(50., -800., 900.);
    struct kin_winch *g = kin_winch_new_radius();
    struct kin_polar *h = kin_polar_new();
    struct kin_delta *i = kin_deltesian_new(250. * 250., -130.);
    struct kin_rotary_delta *j = kin_rotary_delta_new(40., 300., 1., 120., 260.);

    m->is[0] = a ? &a->is : NULL;
    m->is[1] = b ? &b->is : NULL;
    m->is[2] = c ? &c->is : NULL;
    m->is[3] = d ? &d->is : NULL;
    m->is[4] = e ? &e->is : NULL;
    m->is[5] = f ? &f->is : NULL;
    m->is[6] = g ? &g->is : NULL;
    m->is[7] = h ? &h->is : NULL;
    m->is[8] = i ? &i->is : NULL;
    m->is[9] = j ? &j->is : NULL;
}

/* Shape some of them; one by a kernel.  Filament is shaped by either, and what
 * belongs to z is not: its shares change on arcs. */
static int
shape(struct machine *m)
{
    const struct shaper_axis impulses = {
        .n_impulses = 3, .weights = { .25, .5, .25 },
        .delays = { -.01, 0., .01 },
    };
    const struct shaper_axis kernel = {
        .n_coeffs = 3, .coeffs = { .75, 0., -.75 }, .half = .012,
    };
    static const int shaped[] = { 0, 1, 2, 4, 7 };

    for (int k = 0; k < 5; k++) {
        int i = shaped[k];
        m->paths[i] = shaper_path_new();
        if (!m->paths[i])
            return -ENOMEM;
        for (int axis = 0; axis < (i == 4 ? 2 : 3); axis++)
            expect(!shaper_path_set_axis(m->paths[i], axis,
                                         i == 1 || (i == 4 && !axis)
                                         ? &kernel : &impulses),
                   "shaper is a mean");
        expect(!shaper_path_check(m->paths[i]), "shaper holds");
        if (i != 4)
            shaper_attach(m->is[i], m->paths[i]);
    }
    kin_extruder_set_shaper((struct kin_extruder *)m->is[4], m->paths[4],
                            m->tq);
    return 0;
}

/* Returns 0 or -ENOMEM; destroy() takes either. */
static int
build(struct machine *m)
{
    struct qsink sink = { m, count_messages };
    struct stepcompress_options options = { 400, 5, 6, 0 };
    const double nothing[3] = { 0. };

    m->pool = m->n_threads < 0 ? NULL : steppool_new(m->n_threads);
    m->tq = trapq_new();
    m->filament = trapq_new();
    m->ss = steppersync_new(&sink, MOVE_COUNT);
    make_kinematics(m);
    if (!m->tq || !m->filament || !m->ss || (m->n_threads >= 0 && !m->pool))
        return -ENOMEM;
    steppersync_set_time(m->ss, 0., FREQ);
    for (int i = 0; i < STEPPERS; i++) {
        m->sc[i] = stepcompress_new((uint32_t)i);
        if (!m->is[i] || !m->sc[i])
            return -ENOMEM;
        stepcompress_configure(m->sc[i], &options);
        itersolve_set_trapq(m->is[i], i == 4 ? m->filament : m->tq);
        itersolve_set_stepcompress(m->is[i], m->sc[i], .005);
        itersolve_set_position(m->is[i], i == 4 ? nothing : m->position);
        if (steppersync_add(m->ss, m->sc[i], m->is[i]) != i)
            return -ENOMEM;
    }
    return shape(m);
}

static void
destroy(struct machine *m)
{
    steppool_delete(m->pool);
    steppersync_delete(m->ss);
    for (int i = 0; i < STEPPERS; i++) {
        stepcompress_delete(m->sc[i]);
        shaper_path_delete(m->paths[i]);
        free(m->is[i]);
    }
    trapq_delete(m->tq);
    trapq_delete(m->filament);
}

static void
check(const struct machine *m)
{
    expect(!trapq_check(m->tq), "trapq holds");
    expect(!trapq_check(m->filament), "the filament's holds");
    expect(!steppersync_check(m->ss), "steppersync holds");
    expect(!m->pool || !steppool_check(m->pool), "the pool holds");
}

/* The filament of the head's last move; now and then none, or not led. */
static int
push_filament(struct machine *m, int i, double time,
              const struct trap_move *head)
{
    double rate = i & 1 ? .4 : .2;
    struct trap_move move = {
        .accel_t = head->accel_t, .cruise_t = head->cruise_t,
        .decel_t = head->decel_t, .start = { m->pushed },
        .axes_r = { 1., i % 9 != 4 }, .start_v = rate * head->start_v,
        .cruise_v = rate * head->cruise_v, .accel = rate * head->accel,
    };
    const struct trapseg *seg;
    int ret;

    if (i % 11 == 7)
        return 0;
    ret = trapq_add_like(m->filament, time, &move, head);
    if (ret)
        return ret;
    seg = trapq_get(m->filament, m->filament->end - 1);
    expect(seg->time == trapq_get(m->tq, m->tq->end - 1)->time
           && m->filament->end_time == m->tq->end_time, "cuts are the same");
    m->pushed = seg->start[0] + trapseg_get_distance(seg, seg->duration);
    return 0;
}

/* One move in direction number `i`; its speed swings.  Some are arcs, of which
 * every other is so tight that its phases are cut. */
static int
add_move(struct machine *m, int i)
{
    double turn = 2.4 * i, v = 20. + 15. * sin(i), accel = 2000.;
    struct trap_move move = {
        .accel_t = .5 * v / accel, .cruise_t = .01, .decel_t = .5 * v / accel,
        .axes_r = { .8 * cos(turn), .8 * sin(turn), i & 1 ? .6 : -.6 },
        .start_v = .5 * v, .cruise_v = v, .accel = accel,
    };
    double way = v * move.cruise_t + 1.5 * v * move.accel_t;
    double time = m->time + (i % 7 ? 0. : .05), tight = i % 30 ? .02 : .5;
    struct trapseg path = { .turn = i % 15 ? 0. : tight * sin(5. * i), .normal = 2 };
    int ret;

    if (i % 45 == 0)
        path.normal = (uint32_t)i % 2;
    move.turn = path.turn;
    move.normal = path.normal;
    for (int k = 0; k < 3; k++) {
        path.start[k] = move.start[k] = m->position[k];
        path.axes_r[k] = move.axes_r[k];
    }
    trapseg_get_place(&path, way, m->position);
    ret = trapq_add(m->tq, time, &move);
    m->time = m->tq->end_time;
    return ret ? ret : push_filament(m, i, time, &move);
}

/* By the threads of a pool, if there is one; meanwhile nothing is touched. */
static int
generate(struct machine *m, double until, uint64_t clock)
{
    int ret;

    if (!m->pool)
        return steppersync_generate(m->ss, until);
    ret = steppersync_start(m->ss, m->pool, until, clock);
    steppool_start(m->pool);
    for (volatile int i = 0; i < 1000; i++)
        ;
    return ret ? ret : steppersync_finish(m->ss);
}

static int
make_steps(struct machine *m, double until)
{
    uint64_t clock = (uint64_t)(until * FREQ);
    int ret = generate(m, until, clock);

    if (!ret)
        ret = steppersync_flush(m->ss, clock,
                                clock > 8000000 ? clock - 8000000 : 0);
    trapq_finalize(m->tq, until - .2, until - 1.);
    trapq_finalize(m->filament, until - .2, until - 1.);
    if (!ret)
        check(m);
    return ret;
}

static int
print_moves(struct machine *m)
{
    int ret = 0;

    for (int i = 0; i < MOVES && !ret; i++) {
        ret = add_move(m, i);
        if (!ret && i % 40 == 5) {
            struct advance_model model = {
                (enum advance_kind)(i / 40 % 3), .01 * (i % 3), .02, 5., .04,
                .01 * (i / 40 % 2),
            };
            ret = kin_extruder_set_model((struct kin_extruder *)m->is[4],
                                         m->time, &model);
        }
        if (!ret && i % 25 == 24)
            ret = make_steps(m, m->time - .3);
    }
    return ret ? ret : make_steps(m, m->time + .3);
}

/* What happens at the end of a homing move. */
static int
home(struct machine *m)
{
    const double there[3] = { 3., 4., 5. };
    static const uint8_t text[] = { 9, 9 };
    int ret = trapq_set_position(m->tq, m->time + 1., there);

    if (!ret)
        ret = trapq_set_position(m->filament, m->time + 1., there);
    for (int i = 0; i < STEPPERS && !ret; i++) {
        int64_t clock = (int64_t)((m->time + 1.) * FREQ);
        ret = stepcompress_reset(m->sc[i], clock);
        if (!ret)
            ret = stepcompress_set_last_position(m->sc[i], clock, 1000);
        if (!ret)
            ret = stepcompress_add_message(m->sc[i], text, sizeof(text), 0);
        itersolve_set_position(m->is[i], there);
    }
    for (int i = 0; i < 3; i++)
        m->position[i] = there[i];
    m->pushed = there[0];
    m->time += 1.5;
    return ret;
}

static int
look_back(const struct machine *m)
{
    struct trap_record records[8];
    struct stephistory runs[8];
    int count = trapq_extract(m->tq, records, 8, 0., 1e9);

    for (int i = 0; i < STEPPERS; i++) {
        count += stepcompress_extract(m->sc[i], runs, 8, 0, INT64_MAX);
        count += stepcompress_find_position(m->sc[i], 0) == 12345;
    }
    return count;
}

static int
tell(uint64_t *messages, uint64_t *hash, int n_threads)
{
    struct machine m = {
        .position = { 1., 2., 3. }, .time = .5, .n_threads = n_threads,
    };
    int ret = build(&m);

    ret = ret ? ret : print_moves(&m);
    ret = ret ? ret : home(&m);
    ret = ret ? ret : print_moves(&m);
    if (!ret)
        expect(look_back(&m) > 8, "there is a history");
    *messages = m.messages;
    *hash = m.hash;
    destroy(&m);
    return ret;
}

int
main(int argc, char **argv)
{
    uint64_t whole, part, hash, other;
    long total, told = 0, step = argc > 1 ? atol(argv[1]) : 0;

    expect(!tell(&whole, &hash, -1), "no error");
    for (int n = 0; n < 4; n++) {
        n_allocs = 0;
        expect(!tell(&part, &other, n), "no error with threads");
        expect(part == whole && other == hash, "messages are the same");
    }
    total = n_allocs;
    for (failing = 1; step && failing <= total; failing++) {
        int ret;
        /* the first ones build everything; later ones repeat themselves */
        if (failing > 200 && failing % step)
            continue;
        n_allocs = 0;
        ret = tell(&part, &other, failing % 5 ? -1 : 2);
        expect(ret == -ENOMEM || (!ret && part == whole), "out of memory");
        expect(part <= whole, "no more messages than in the whole story");
        told++;
    }
    printf("%ld messages, %ld allocations, %ld made to fail\n", (long)whole,
           total, told);
    return 0;
}
