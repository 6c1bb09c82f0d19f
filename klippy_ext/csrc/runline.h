/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * How far a straight line gets through gates: the longest run of steps.
 *
 * Step k of a run with an interval and an add is k times as far from the start
 * as the line interval + add / 2 * x at x = k - 1.  A run that meets all
 * windows, but for whole numbers, is a line through the gates that the
 * windows, divided by k, put in its way.
 *
 * How: a line of some add goes until a gate stops it.  That gate, with each one
 * before it, bounds the adds that get further, so that a few tries are enough:
 * some line of an add gets through gates if one does through any two of them.
 */
#ifndef RUNLINE_H
#define RUNLINE_H

#include "runcurve.h"

enum { RUNLINE_MAX = 512 };

/* The gates of the next windows, as far as they were asked for. */
struct runline {
    struct runview view;
    int n, n_parts;             /* of gates; of parts, which stay */
    double part[RUNLINE_MAX];   /* 1 / k */
    double low[RUNLINE_MAX], high[RUNLINE_MAX];
};

/* No gates yet.  A line begins as zeros. */
void runline_init(struct runline *l, const struct runview *view);
/* How many of the first n gates (at most RUNLINE_MAX) a line of this add and
 * any whole interval gets through (but for rounding), and the least and
 * greatest of these. */
int runline_find_intervals(struct runline *l, double add, int n, double *least,
                           double *most);
/* The greatest number of gates, of n, that a line gets through, about, and the
 * curve of a run that meets these windows and ends close to the middle of the
 * last.  add: a guess.  Returns 0 if there is none of two steps or more. */
int runline_find_longest(struct runline *l, int n, double add,
                         struct runcurve *c);
/* The curve of this add and an interval between two that ends closest to where
 * step n is wanted.  Returns by how much that is missed. */
double runline_aim(const struct runline *l, int n, double add, double least,
                   double most, struct runcurve *c);
/* 0, or a negative number that says which invariant does not hold. */
int runline_check(const struct runline *l);

#endif
