/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Clocks of a run's steps, two at once, each by the way from the ones before:
 * as all numbers are whole, or halves, these sums are exact.
 */
#ifndef RUNPAIR_H
#define RUNPAIR_H

#include "pair.h"
#include "runcurve.h"

struct runpair {
    pair clocks, ways, bend;
};

/* Steps k and k + 1 of a run that began at `start`. */
static inline struct runpair
runpair_begin(const struct runcurve *c, double k, double start)
{
    double way = 2. * c->interval + c->add * (2. * k - 1.);

    return (struct runpair) {
        { runcurve_get(c, k) + start, runcurve_get(c, k + 1.) + start },
        { way + 2. * c->add, way + 4. * c->add }, pair_of(4. * c->add),
    };
}

/* The next two. */
static inline void
runpair_move(struct runpair *p)
{
    p->clocks += p->ways;
    p->ways += p->bend;
}

#endif
