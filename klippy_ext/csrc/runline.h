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

#include <stdint.h>

enum { RUNLINE_MAX = 256 };

/* Number of gates, of n (at most RUNLINE_MAX), that one line gets through;
 * *slope is in the middle of what is possible (0 for less than 2).
 * wanted, error: windows in order; start: clock before the first. */
int runline_aim(const int64_t *wanted, const uint32_t *error, int64_t start,
                int n, double *slope);

#endif
