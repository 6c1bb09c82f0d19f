/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * How far a straight line gets through gates: the longest run of steps.
 *
 * Step k of a run with an interval and an add is k times as far from the start
 * as the line interval + add / 2 * x at x = k - 1.  A run that meets all
 * windows, but for whole numbers, is a line through the gates that the
 * windows, divided by k, put in its way.
 */
#ifndef RUNLINE_H
#define RUNLINE_H

#include "runcurve.h"

enum { RUNLINE_MAX = 256 };

/* The gates of the next windows, as far as they were asked for. */
struct runline {
    struct runview view;
    int n;
    double low[RUNLINE_MAX], high[RUNLINE_MAX];
};

/* No gates yet. */
void runline_init(struct runline *l, const struct runview *view);
/* Number of gates, of n (at most RUNLINE_MAX), that one line gets through, as
 * far as every `every`-th of them tells; *slope is in the middle of what is
 * possible (0 for no more than `every`). */
int runline_aim(struct runline *l, int n, int every, double *slope);
/* How many of the first n gates a line of this add and any whole interval gets
 * through (but for rounding), and the least and greatest of these. */
int runline_find_intervals(struct runline *l, double add, int n, double *least,
                           double *most);

#endif
