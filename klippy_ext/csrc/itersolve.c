/* SPDX-License-Identifier: GPL-3.0-or-later
 * Times of steps, what all kinematics share.  See itersolve.h. */
#include <math.h>
#include <string.h>

#include "arcfit.h"
#include "itersolve.h"
#include "minmax.h"
#include "shaper.h"
#include "stepcompress.h"

void
itersolve_init(struct itersolve *is, const struct itersolve_kind *kind,
               uint32_t active_axes)
{
    is->kind = kind;
    is->active_axes = active_axes;
    is->step_dist = is->inv_step_dist = 1.;
}

void
itersolve_set_trapq(struct itersolve *is, const struct trapq *tq)
{
    is->tq = tq;
    is->cursor = 0;
}

void
itersolve_set_stepcompress(struct itersolve *is, struct stepcompress *sc,
                           double step_dist)
{
    double commanded = itersolve_get_commanded_pos(is);

    is->sc = sc;
    is->step_dist = step_dist;
    is->inv_step_dist = 1. / step_dist;
    is->origin = commanded;
    is->n_steps = 0;
}

double
itersolve_calc_position(const struct itersolve *is, const double pos[3])
{
    return is->kind->get_position(is, pos);
}

void
itersolve_set_position(struct itersolve *is, const double pos[3])
{
    is->origin = itersolve_calc_position(is, pos);
    is->n_steps = 0;
    shaper_forget(is);
}

double
itersolve_get_commanded_pos(const struct itersolve *is)
{
    return is->origin + (double)is->n_steps * is->step_dist;
}

int
itersolve_is_active_axis(const struct itersolve *is, char axis)
{
    return axis >= 'x' && axis <= 'z'
        && (is->active_axes & (1u << (axis - 'x'))) != 0;
}

double
itersolve_find_active(const struct itersolve *is, double until)
{
    const struct trapq *tq = is->tq;
    double ahead = is->scan_post, from = is->done_time - is->scan_pre;

    if (!tq)
        return 0.;
    for (uint64_t i = trapq_find(tq, is->cursor, from); i < tq->end; i++) {
        const struct trapseg *seg = trapq_get(tq, i);
        if (seg->time - ahead >= until)
            break;
        if (itersolve_is_moved_by(is, seg) && !trapseg_is_rest(seg))
            return fmax(seg->time - ahead, 0.);
    }
    return 0.;
}

/* ---- Making steps ---- */

int
itersolve_push(struct itersolve *is, const double *times, int n, int dir)
{
    is->n_steps += dir * n;
    return is->sc ? stepcompress_push(is->sc, times, n, dir) : 0;
}

/* Count the steps by which `steps` is out of the range. */
static int
push_jump(struct itersolve *is, double time, double steps)
{
    double off = steps - (double)is->n_steps;
    int dir = off > 0. ? 1 : -1, ret = 0;

    if (!(fabs(off) < ITERSOLVE_JUMP_MAX))
        return ITERSOLVE_EJUMP;
    for (int64_t n = (int64_t)(fabs(off) + .5); n > 0 && !ret; n--)
        ret = itersolve_push(is, &time, 1, dir);
    return ret;
}

int
itersolve_align(struct itersolve *is, double time, double steps)
{
    if (fabs(steps - (double)is->n_steps) <= .5 + STEP_SLACK)
        return 0;
    return push_jump(is, time, steps);
}

/* The part of q between `from` and `to`, on which it never turns. */
static int
emit_monotone(struct itersolve *is, const struct quadratic *q, double from,
              double to)
{
    double begin = q->p0 + (q->p1 + q->p2 * from) * from;
    double end = q->p0 + (q->p1 + q->p2 * to) * to;
    int dir = end >= begin ? 1 : -1;
    int ret = itersolve_align(is, q->time + from, begin);
    int64_t count = itersolve_count_to(is, end, dir);
    double first = dir * (itersolve_get_level(is, 0, dir) - begin);
    struct stepway w = {
        max_of(first, 0.), max_of(dir * (q->p1 + 2. * q->p2 * from), 0.),
        dir * q->p2, q->time + from,
    };

    if (ret || count <= 0)
        return ret;
    is->n_steps += dir * count;
    return is->sc ? stepcompress_push_way(is->sc, &w, count, dir) : 0;
}

int
itersolve_emit_quadratic(struct itersolve *is, const struct quadratic *q,
                         double from, double to)
{
    double before = q->p1 + 2. * q->p2 * from;
    double after = q->p1 + 2. * q->p2 * to, turn;
    int ret;

    if (before * after >= 0.)
        return emit_monotone(is, q, from, to);
    turn = -.5 * q->p1 / q->p2;
    if (!(from < turn && turn < to))
        return emit_monotone(is, q, from, to);
    ret = emit_monotone(is, q, from, turn);
    return ret ? ret : emit_monotone(is, q, turn, to);
}

static int
emit_segment(struct itersolve *is, const struct trapseg *seg, double from,
             double to)
{
    const struct itersolve_kind *kind = is->kind;

    if (seg->turn == 0.)
        return kind->emit(is, seg, from, to);
    return kind->emit_arc ? kind->emit_arc(is, seg, from, to)
                          : arcfit_emit(is, seg, from, to);
}

static int
emit_segments(struct itersolve *is, double start, double end)
{
    const struct trapq *tq = is->tq;
    uint64_t i = trapq_find(tq, is->cursor, start);
    int ret = 0;

    for (; i < tq->end && !ret; i++) {
        const struct trapseg *seg = trapq_get(tq, i);
        double from = max_of(start - seg->time, 0.);
        double to = min_of(end - seg->time, seg->duration);
        is->cursor = i;
        if (seg->time >= end)
            break;
        if (to > from && itersolve_is_moved_by(is, seg))
            ret = emit_segment(is, seg, from, to);
    }
    return ret;
}

static int
emit_between(struct itersolve *is, double start, double end)
{
    if (is->path)
        return shaper_emit(is, start, end);
    return is->kind->emit_range ? is->kind->emit_range(is, start, end)
                                : emit_segments(is, start, end);
}

int
itersolve_generate(struct itersolve *is, double print_time)
{
    double start = is->done_time;
    int ret = 0;

    if (!(print_time > start))
        return 0;
    is->done_time = print_time;
    if (is->tq && is->active_axes && !trapq_is_empty(is->tq))
        ret = emit_between(is, start, print_time);
    if (is->sc)
        stepcompress_note_made(is->sc, print_time);
    return ret;
}

int
itersolve_check(const struct itersolve *is)
{
    if (!(is->step_dist > 0.)
        || fabs(is->step_dist * is->inv_step_dist - 1.) > 1e-12)
        return -1;
    if (!isfinite(is->origin) || !(is->done_time >= 0.))
        return -2;
    if (is->scan_pre < 0. || is->scan_post < 0.)
        return -3;
    if (is->path && shaper_path_check(is->path))
        return shaper_path_check(is->path);
    return is->kind->check ? is->kind->check(is) : 0;
}
