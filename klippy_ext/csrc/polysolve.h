/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Steps of a position that is a polynomial of degree four in time.
 */
#ifndef POLYSOLVE_H
#define POLYSOLVE_H

#include "itersolve.h"

struct quartic {
    double time;                /* print_time of t = 0 */
    double p[5];                /* in steps, by power of t */
};

/* Make the steps for t in [0, duration].  Returns as itersolve_generate(). */
int polysolve_emit(struct itersolve *is, const struct quartic *q,
                   double duration);

#endif
