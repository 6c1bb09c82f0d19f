/* SPDX-License-Identifier: GPL-3.0-or-later
 * Runs that go on.  See runtrack.h. */
#include <math.h>

#include "minmax.h"
#include "runpair.h"
#include "runtrack.h"

enum { BLOCK = 16 };

void
runtrack_init(struct runtrack *t, double add)
{
    *t = (struct runtrack) { add, 1., UINT32_MAX };
}

/* Do the least and the greatest interval meet all windows of a block, of which
 * the first is for step k?  They do if the one between them meets windows that
 * are smaller by how far they are from it. */
static inline int
is_block_met(const struct runtrack *t, const struct runview *v, int64_t i,
             double k)
{
    double radius = .5 * (t->interval_hi - t->interval_lo);
    const struct runcurve middle = { t->interval_lo + radius, t->add };
    struct runpair at = runpair_begin(&middle, k, v->start);
    pair less = { radius * k, radius * (k + 1.) };
    pair_mask signs = { 0, 0 };

    for (int n = 0; n < BLOCK; n += 2, less += 2. * radius) {
        pair off = pair_abs(at.clocks - pair_load(v->wanted + i + n));
        signs |= pair_compare(pair_load(v->error + i + n) - less, off);
        runpair_move(&at);
    }
    return !pair_is_less(signs);
}

/* Let the track meet one window.  Returns 0, and leaves it, if it cannot. */
static int
meet(struct runtrack *t, double k, double low, double high)
{
    double bend = .5 * t->add * (k - 1.) * k;
    double least = (low - bend) / k, most = (high - bend) / k;
    double lo = t->interval_lo, hi = t->interval_hi;

    if (lo < least)
        lo = ceil(least);
    if (hi > most)
        hi = floor(most);
    if (lo > hi)
        return 0;
    t->interval_lo = lo;
    t->interval_hi = hi;
    return 1;
}

int64_t
runtrack_run(struct runtrack *t, const struct runview *v, int64_t from,
             int64_t n)
{
    struct runcurve c = { 0., t->add };
    struct runview rest = *v;
    int64_t i = 0;

    while (i < n && t->interval_lo < t->interval_hi) {
        int64_t end = i + BLOCK < n ? i + BLOCK : n;
        if (i + BLOCK <= n && is_block_met(t, v, i, (double)(from + i + 1)))
            i = end;
        for (; i < end; i++) {
            double wanted = v->wanted[i] - v->start, error = v->error[i];
            if (!meet(t, (double)(from + i + 1), wanted - error,
                      wanted + error))
                return i;
        }
    }
    c.interval = t->interval_lo;
    rest.wanted += i;
    rest.error += i;
    return i + runcurve_count_met(&c, &rest, from + i, n - i);
}

double
runtrack_aim(const struct runtrack *t, double k, double wanted,
             struct runcurve *c)
{
    *c = (struct runcurve) { 0., t->add };
    wanted -= runcurve_get(c, k);
    c->interval = pair_round_one(wanted / k);
    c->interval = min_of(max_of(c->interval, t->interval_lo),
                         t->interval_hi);
    return fabs(c->interval * k - wanted);
}

int
runtrack_check(const struct runtrack *t)
{
    const struct runcurve first = { t->interval_lo, t->add };
    const struct runcurve last = { t->interval_hi, t->add };
    int ret = runcurve_check(&first);

    if (ret || t->interval_lo > t->interval_hi)
        return ret ? ret : -22;
    return runcurve_check(&last);
}
