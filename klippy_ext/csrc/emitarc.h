/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Steps along an arc whose places can be solved for.
 *
 * What counts, v (the stepper's position, or something it rises with), is
 * middle + swing * cos(angle - top): the projection of a circle.  It falls
 * and rises half a turn each, in which acos() tells the angle of a value, the
 * angle the place and the place the time.
 */
#ifndef EMITARC_H
#define EMITARC_H

#include "emitline.h"

struct arc {
    double rate;                /* rad a mm of the way, > 0 */
    double middle, swing;       /* swing > 0 */
    double top;                 /* angle of the greatest value */
    double begin;               /* angle at which the half turn begins */
};

/* v after s mm. */
static inline double
emitarc_get(const struct arc *a, double s)
{
    return a->middle + a->swing * cos(a->rate * s - a->top);
}

/* Place in the half turn at which v is this; dir: does it rise there? */
static inline double
emitarc_solve(const struct arc *a, double v, int dir)
{
    double cosine = (a->middle - v) * dir / a->swing;

    cosine = cosine < 1. ? cosine : 1.;
    return (a->begin + acos(cosine > -1. ? cosine : -1.)) / a->rate;
}

/* Steps between two times.  kind: its first member is a struct arc. */
EMITLINE_INLINE int
emitarc_emit(struct itersolve *is, const struct trapseg *seg, struct arc *a,
             emitline_get *get, emitline_solve *solve, double from,
             double to)
{
    double half = 3.14159265358979323846;
    double angle = a->rate * trapseg_get_distance(seg, from);
    double number = floor((angle - a->top) / half);
    int ret = 0;

    for (double t = from; t < to && !ret; number += 1.) {
        double end = a->top + (number + 1.) * half, until;
        until = end / a->rate < trapseg_get_distance(seg, to)
            ? fmin(fmax(trapseg_solve_time(seg, end / a->rate), t), to) : to;
        a->begin = end - half;
        ret = emitline_monotone(is, seg, a, get, solve, t, until);
        t = until;
    }
    return ret;
}

#endif
