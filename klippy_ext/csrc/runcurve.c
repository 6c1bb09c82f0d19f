/* SPDX-License-Identifier: GPL-3.0-or-later
 * A run against windows.  See runcurve.h. */
#include <math.h>

#include "runpair.h"

enum { BLOCK = 8 };

int64_t
runcurve_count_met(const struct runcurve *c, const struct runview *v,
                   int64_t from, int64_t n)
{
    double first = (double)from + 1.;
    const double *wanted = v->wanted, *error = v->error;
    struct runpair at = runpair_begin(c, first, v->start);
    int64_t i = 0;

    for (; i + BLOCK <= n; i += BLOCK) {
        pair_mask signs = { 0, 0 };
        for (int j = 0; j < BLOCK; j += 2) {
            pair off = pair_abs(at.clocks - pair_load(wanted + i + j));
            signs |= pair_compare(pair_load(error + i + j), off);
            runpair_move(&at);
        }
        if (pair_is_less(signs))
            break;
    }
    for (; i < n; i++) {
        double clock = runcurve_get(c, first + (double)i) + v->start;
        if (fabs(clock - wanted[i]) > error[i])
            break;
    }
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
