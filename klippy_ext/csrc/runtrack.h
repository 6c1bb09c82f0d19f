/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * One add, and all intervals with which a run meets the windows so far: for
 * runs that are longer than what can be stored.
 */
#ifndef RUNTRACK_H
#define RUNTRACK_H

#include "runcurve.h"

struct runtrack {
    double add, interval_lo, interval_hi;
};

void runtrack_init(struct runtrack *t, double add);
/* Let it meet n windows, which are for steps from + 1, from + 2, ...; it is
 * then as after those it meets.  Returns how many. */
int64_t runtrack_run(struct runtrack *t, const struct runview *v, int64_t from,
                     int64_t n);
/* The curve that brings step k closest to a clock (from the start).  Returns by
 * how much that is missed. */
double runtrack_aim(const struct runtrack *t, double k, double wanted,
                    struct runcurve *c);
/* 0, or a negative number that says which invariant does not hold. */
int runtrack_check(const struct runtrack *t);

#endif
