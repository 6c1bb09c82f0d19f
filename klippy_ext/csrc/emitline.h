/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Steps along a straight line whose places can be solved for: the stepper's
 * position after `s` mm of the line rises or falls, turns once at most, and
 * has an inverse in closed form.  Time then follows from the place.
 *
 * A kind gives two functions of its own line; all is inline, so that they
 * become part of the loop.
 */
#ifndef EMITLINE_H
#define EMITLINE_H

#include <math.h>

#include "itersolve.h"

enum { EMITLINE_BATCH = 64 };

/* Stepper position after s mm. */
typedef double emitline_get(const void *line, double s);
/* Where the position is this, on the piece that rises (dir 1) or falls (-1);
 * anything, if it is there nowhere. */
typedef double emitline_solve(const void *line, double position, int dir);

/* Time from the start of a segment to a place on it; 1e-300 is for 0 / 0. */
static inline double
emitline_solve_time(const struct trapseg *seg, double s)
{
    double inside = seg->start_v * seg->start_v + 4. * seg->half_accel * s;

    return 2. * s / (seg->start_v + sqrt(fmax(inside, 0.)) + 1e-300);
}

/* Steps between two times, between which the stepper keeps its direction. */
static inline int
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
        double times[EMITLINE_BATCH];
        int n = count < EMITLINE_BATCH ? (int)count : EMITLINE_BATCH;
        for (int i = 0; i < n; i++) {
            double level = itersolve_get_level(is, i, dir);
            double position = is->origin + level * is->step_dist;
            double t = emitline_solve_time(seg, solve(line, position, dir));
            times[i] = seg->time + fmin(fmax(t, from), to);
        }
        count -= n;
        ret = itersolve_push(is, times, n, dir);
    }
    return ret;
}

/* Steps between two times; the stepper turns after `turn` mm, if that is
 * between them. */
static inline int
emitline_emit(struct itersolve *is, const struct trapseg *seg,
              const void *line, emitline_get *get, emitline_solve *solve,
              double turn, double from, double to)
{
    double turn_time = to;
    int ret;

    if (turn > trapseg_get_distance(seg, from)
        && turn < trapseg_get_distance(seg, to))
        turn_time = fmin(fmax(emitline_solve_time(seg, turn), from), to);
    ret = emitline_monotone(is, seg, line, get, solve, from, turn_time);
    if (ret || turn_time >= to)
        return ret;
    return emitline_monotone(is, seg, line, get, solve, turn_time, to);
}

#endif
