/* SPDX-License-Identifier: GPL-3.0-or-later
 * How far a line gets.  See runline.h. */
#include <math.h>

#include "pair.h"
#include "runline.h"
#include "runtrack.h"

enum { BLOCK = 8, TRIES_MAX = 8 };

/* Part of an interval by which rounding may move its bounds. */
#define SLACK 1e-13

struct bounds {
    double least, most;
};

void
runline_init(struct runline *l, const struct runview *view)
{
    l->view = *view;
    l->n = 0;
}

/* Parts are the same for all runs. */
static void
add_parts(struct runline *l, int n)
{
    for (; l->n_parts < n; l->n_parts += 2) {
        pair k = { l->n_parts + 1, l->n_parts + 2 };
        pair_store(l->part + l->n_parts, 1. / k);
    }
}

/* Have at least the first n gates. */
static inline void
fill(struct runline *l, int n)
{
    const double *wanted = l->view.wanted, *error = l->view.error;
    pair start = pair_of(l->view.start);
    int i = l->n;

    if (i >= n)
        return;
    if (n > l->n_parts)
        add_parts(l, n);
    for (; i < n; i += 2) {
        pair part = pair_load(l->part + i);
        pair middle = (pair_load(wanted + i) - start) * part;
        pair half = pair_load(error + i) * part;
        pair_store(l->low + i, middle - half);
        pair_store(l->high + i, middle + half);
    }
    l->n = i;
}

/* ---- One add ---- */

/* The least whole number that is no less (but for rounding); x is above 0. */
static inline double
get_whole(double x)
{
    double down;

    x *= 1. - SLACK;
    down = (double)(int64_t)x;
    return down < x ? down + 1. : down;
}

static inline int
has_whole(struct bounds b)
{
    return b.most - b.least >= 1.
        || get_whole(b.least) <= b.most * (1. + SLACK);
}

static inline struct bounds
get_bounds(pair least, pair most)
{
    return (struct bounds) {
        least[0] > least[1] ? least[0] : least[1],
        most[0] < most[1] ? most[0] : most[1],
    };
}

/* Bounds that a block of gates leaves to the interval. */
static inline struct bounds
pass_block(const struct runline *l, int i, double half, struct bounds b)
{
    pair least = pair_of(b.least), most = pair_of(b.most);
    double first = half * i;
    pair bend = { first, first + half };

    for (int k = i; k < i + BLOCK; k += 2, bend += 2. * half) {
        least = pair_max(pair_load(l->low + k) - bend, least);
        most = pair_min(pair_load(l->high + k) - bend, most);
    }
    return get_bounds(least, most);
}

static inline struct bounds
pass_one(const struct runline *l, int i, double bend, struct bounds b)
{
    double low = l->low[i] - bend, high = l->high[i] - bend;

    return (struct bounds) {
        low > b.least ? low : b.least, high < b.most ? high : b.most,
    };
}

int
runline_find_intervals(struct runline *l, double add, int n, double *least,
                       double *most)
{
    struct bounds b = { 1., UINT32_MAX }, next;
    double half = .5 * add, bend;
    int i = 0;

    for (; i + BLOCK <= n; i += BLOCK, b = next) {
        fill(l, i + BLOCK);
        next = pass_block(l, i, half, b);
        if (!has_whole(next))
            break;
    }
    fill(l, i + BLOCK <= n ? i + BLOCK : n);
    bend = half * i;
    for (; i < n; i++, b = next, bend += half) {
        next = pass_one(l, i, bend, b);
        if (!has_whole(next))
            break;
    }
    *least = get_whole(b.least);
    *most = (double)(int64_t)(b.most * (1. + SLACK));
    return i;
}

double
runline_aim(const struct runline *l, int n, double add, double least,
            double most, struct runcurve *c)
{
    const struct runtrack t = { add, least, most };

    return runtrack_aim(&t, (double)n, runview_get(&l->view, n), c);
}

/* ---- The longest ---- */

/* Bounds of adds between which lines pass gate i and any single one before. */
static struct bounds
narrow(const struct runline *l, int i, struct bounds b)
{
    double low = 2. * l->low[i], high = 2. * l->high[i];
    pair least = pair_of(b.least), most = pair_of(b.most);
    int j = i & 1;

    if (j) {
        least = pair_max(pair_of((low - 2. * l->high[0]) * l->part[i - 1]),
                         least);
        most = pair_min(pair_of((high - 2. * l->low[0]) * l->part[i - 1]),
                        most);
    }
    for (; j < i; j += 2) {
        pair part = pair_swap(pair_load(l->part + i - j - 2));
        least = pair_max((low - 2. * pair_load(l->high + j)) * part, least);
        most = pair_min((high - 2. * pair_load(l->low + j)) * part, most);
    }
    return get_bounds(least, most);
}

/* The add closest to the middle of the bounds; `last` if there is no other. */
static double
choose_add(struct bounds b, double last)
{
    double add = pair_round_one(.5 * (b.least + b.most));

    if (add < b.least)
        add += 1.;
    if (add > b.most)
        add -= 1.;
    return add < b.least ? last : add;
}

int
runline_find_longest(struct runline *l, int n, double add, struct runcurve *c)
{
    struct bounds adds = { -RUNCURVE_ADD_MAX, RUNCURVE_ADD_MAX }, found;
    double next = add, best_add = add;
    int best = 0;

    for (int i = 0; i < TRIES_MAX && (!i || next != add); i++) {
        struct bounds b;
        int reach;
        add = next;
        reach = runline_find_intervals(l, add, n, &b.least, &b.most);
        if (reach >= best) {
            best = reach;
            best_add = add;
            found = b;
        }
        if (reach < n) {
            adds = narrow(l, reach, adds);
            next = choose_add(adds, add);
        }
    }
    if (best < 2)
        return 0;
    runline_aim(l, best, best_add, found.least, found.most, c);
    best = (int)runcurve_count_met(c, &l->view, 0, best);
    return best < 2 ? 0 : best;
}

int
runline_check(const struct runline *l)
{
    if (l->n < 0 || l->n > l->n_parts || l->n_parts > RUNLINE_MAX)
        return -23;
    for (int i = 0; i < l->n_parts; i++)
        if (fabs(l->part[i] * (i + 1) - 1.) > SLACK)
            return -25;
    for (int i = 0; i < l->n; i++)
        if (l->low[i] > l->high[i])
            return -24;
    return 0;
}
