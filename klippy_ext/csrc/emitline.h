/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Steps along a way whose places can be solved for: the stepper's
 * position after `s` mm of it rises or falls, turns once at most, and
 * has an inverse in closed form.  Time then follows from the place.
 *
 * A kind gives two functions of its own line; all is inline, so that they
 * become part of the loop.
 */
#ifndef EMITLINE_H
#define EMITLINE_H

#include <math.h>

#include "itersolve.h"

enum { EMITLINE_BATCH = 128 };

/* Stepper position after s mm. */
typedef double emitline_get(const void *line, double s);
/* Where the position is this, on the piece that rises (dir 1) or falls (-1);
 * anything, if it is there nowhere. */
typedef double emitline_solve(const void *line, double position, int dir);

/* Calls of `get` and `solve` disappear: loops over steps have none, and are
 * made of vectors where `solve` has no jumps. */
#define EMITLINE_INLINE static inline __attribute__((always_inline))

/* Turn places on the way into print_times between two. */
static inline void
emitline_time_places(const struct trapseg *seg, double *places, int n,
                     double from, double to)
{
    double v = seg->start_v, v2 = v * v, four = 4. * seg->half_accel;
    double start = seg->time, inv_v = 1. / v;

    for (int i = 0; four == 0. && i < n; i++)
        places[i] *= inv_v;
    for (int i = 0; four != 0. && i < n; i++) {
        double inside = v2 + four * places[i];
        inside = inside > 0. ? inside : 0.;
        places[i] = 2. * places[i] / (v + sqrt(inside) + 1e-300);
    }
    for (int i = 0; i < n; i++) {
        double t = places[i] > from ? places[i] : from;
        places[i] = start + (t < to ? t : to);
    }
}

/* Steps between two times, between which the stepper keeps its direction. */
EMITLINE_INLINE int
emitline_monotone(struct itersolve *is, const struct trapseg *seg,
                  const void *line, emitline_get *get, emitline_solve *solve,
                  double from, double to)
{
    double begin = itersolve_to_steps(
        is, get(line, trapseg_get_distance(seg, from)));
    double end = itersolve_to_steps(
        is, get(line, trapseg_get_distance(seg, to)));
    int dir = end >= begin ? 1 : -1;
    int ret = itersolve_align(is, seg->time + from, begin);
    int64_t count = itersolve_count_to(is, end, dir);

    while (count > 0 && !ret) {
        double places[EMITLINE_BATCH];
        int n = count < EMITLINE_BATCH ? (int)count : EMITLINE_BATCH;
        double first = is->origin
            + itersolve_get_level(is, 0, dir) * is->step_dist;
        double each = dir * is->step_dist;
        for (int i = 0; i < n; i++)
            places[i] = solve(line, first + each * i, dir);
        emitline_time_places(seg, places, n, from, to);
        count -= n;
        ret = itersolve_push(is, places, n, dir);
    }
    return ret;
}

/* Steps between two times; the stepper turns after `turn` mm, if that is
 * between them. */
EMITLINE_INLINE int
emitline_emit(struct itersolve *is, const struct trapseg *seg,
              const void *line, emitline_get *get, emitline_solve *solve,
              double turn, double from, double to)
{
    double turn_time = to;
    int ret;

    if (turn > trapseg_get_distance(seg, from)
        && turn < trapseg_get_distance(seg, to))
        turn_time = fmin(fmax(trapseg_solve_time(seg, turn), from), to);
    ret = emitline_monotone(is, seg, line, get, solve, from, turn_time);
    if (ret || turn_time >= to)
        return ret;
    return emitline_monotone(is, seg, line, get, solve, turn_time, to);
}

#endif
