/* SPDX-License-Identifier: GPL-3.0-or-later
 * A run against windows.  See runcurve.h. */
#include <math.h>

#include "pair.h"
#include "runcurve.h"

enum { BLOCK = 8 };

/* Are all windows of a block met, of which the first is for step k? */
static inline int
is_block_met(const struct runcurve *c, const struct runview *v, int64_t i,
             double first)
{
    double half = .5 * c->add, rest = c->interval - half, start = v->start;
    pair k = { first, first + 1. };
    pair_mask signs = { 0, 0 };

    for (int n = 0; n < BLOCK; n += 2, k += 2.) {
        pair clock = (rest + half * k) * k + start;
        pair off = pair_abs(clock - pair_load(v->wanted + i + n));
        signs |= pair_compare(pair_load(v->error + i + n), off);
    }
    return !pair_is_less(signs);
}

int64_t
runcurve_count_met(const struct runcurve *c, const struct runview *v,
                   int64_t from, int64_t n)
{
    double k = (double)from + 1.;
    int64_t i = 0;

    while (i + BLOCK <= n && is_block_met(c, v, i, k)) {
        i += BLOCK;
        k += BLOCK;
    }
    for (; i < n; i++, k += 1.)
        if (fabs(runcurve_get(c, k) + v->start - v->wanted[i]) > v->error[i])
            break;
    return i;
}

int
runcurve_check(const struct runcurve *c)
{
    if (!(c->interval >= 1. && c->interval <= UINT32_MAX)
        || c->interval != floor(c->interval))
        return -20;
    if (!(fabs(c->add) <= RUNCURVE_ADD_MAX + 1.) || c->add != floor(c->add))
        return -21;
    return 0;
}
