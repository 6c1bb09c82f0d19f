/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Windows of many steps at once: their clocks, and how far they may be off.
 */
#ifndef STEPBATCH_H
#define STEPBATCH_H

#include <stdint.h>

#include "stepway.h"

struct stepbatch {
    struct stepscale scale;
    uint32_t max_error;
    double before;              /* ticks from the step before to clocks[0] */
    /* Of the step before the new ones, and these.  One more is written. */
    double *clocks, *errors;
};

/* Set the clocks of n > 0 new steps at these print_times, and the errors of
 * what comes before each: max_error, but never half the time to a neighbour.
 * Returns 0 if a step is less than a tick after the one before. */
int stepbatch_set_times(const struct stepbatch *b, const double *times, int n);
/* As before, of steps from number `done` on. */
int stepbatch_set_way(const struct stepbatch *b, const struct stepway *w,
                      int64_t done, int n);

#endif
