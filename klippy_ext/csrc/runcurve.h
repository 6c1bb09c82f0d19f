/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * One run of steps against the windows that it must meet.
 *
 * Step k of a run (k = 1, 2, ...) comes `interval * k + add * k * (k - 1) / 2`
 * after the start.  All numbers are whole, in doubles: they stay below 2^53, so
 * nothing is rounded, and loops work on pairs of them.
 */
#ifndef RUNCURVE_H
#define RUNCURVE_H

#include <stdint.h>

/* Windows that wait for a run, in order, and the clock of the step before. */
struct runview {
    const double *wanted, *error;
    double start;
};

struct runcurve {
    double interval, add;
};

/* A track beside it (runtrack.h) must fit a message, too. */
#define RUNCURVE_ADD_MAX 32766.

/* Step k, from the start. */
static inline double
runcurve_get(const struct runcurve *c, double k)
{
    return (c->interval + .5 * c->add * (k - 1.)) * k;
}

/* Wanted clock of step k = 1, 2, ... from the start. */
static inline double
runview_get(const struct runview *v, int64_t k)
{
    return v->wanted[k - 1] - v->start;
}

/* The first n windows are for steps from + 1, from + 2, ...: how many the curve
 * meets before it misses one. */
int64_t runcurve_count_met(const struct runcurve *c, const struct runview *v,
                           int64_t from, int64_t n);
/* 0, or a negative number that says which invariant does not hold. */
int runcurve_check(const struct runcurve *c);

#endif
