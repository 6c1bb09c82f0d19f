/* SPDX-License-Identifier: GPL-3.0-or-later
 * How far a line gets.  See runline.h. */
#include <math.h>

#include "pair.h"
#include "runline.h"

enum { BLOCK = 16 };

/* Part of an interval by which rounding may move its bounds. */
#define SLACK 1e-13

struct point {
    double x, y;
};

/* The steepest line through the gates so far.  It touches a lower end and,
 * right of it, an upper end.  The hull holds the lower ends that a steepest
 * line to come can touch: each slope between neighbours is less than the one
 * before.  Of the flattest line, all the same upside down. */
struct side {
    struct point hull[RUNLINE_MAX];
    int first, end;             /* hull[first] is touched now */
    struct point upper;         /* touched, too */
    double slope;
};

/* Is the slope from a to c more than that from a to b, which is left of c? */
static inline int
is_steeper(const struct point *a, const struct point *b, const struct point *c)
{
    return (c->y - a->y) * (b->x - a->x) > (b->y - a->y) * (c->x - a->x);
}

static inline double
get_height(const struct side *s, double x)
{
    return s->upper.y + s->slope * (x - s->upper.x);
}

/* The first two gates: any line gets through. */
static void
start_side(struct side *s, double x, double low0, double low1, double high1)
{
    s->hull[0] = (struct point) { 0., low0 };
    s->hull[1] = (struct point) { x, low1 };
    s->first = 0;
    s->end = 2;
    s->slope = (high1 - low0) / x;
    s->upper = (struct point) { x, high1 };
}

/* Turn the line so that it gets below another upper end. */
static inline void
turn(struct side *s, const struct point *upper)
{
    const struct point *p = &s->hull[s->first];

    while (s->first + 1 < s->end && !is_steeper(p, p + 1, upper)) {
        p++;
        s->first++;
    }
    s->slope = (upper->y - p->y) / (upper->x - p->x);
    s->upper = *upper;
}

static inline void
add_lower(struct side *s, const struct point *lower)
{
    while (s->end - s->first > 1
           && is_steeper(&s->hull[s->end - 2], &s->hull[s->end - 1], lower))
        s->end--;
    s->hull[s->end++] = *lower;
}

/* Let the line pass one more gate, which it can. */
static inline void
pass(struct side *s, const struct point *lower, const struct point *upper)
{
    if (upper->y < get_height(s, upper->x))
        turn(s, upper);
    add_lower(s, lower);
}

void
runline_init(struct runline *l, const struct runview *view)
{
    l->view = *view;
    l->n = 0;
}

/* Have at least the first n gates. */
static inline void
fill(struct runline *l, int n)
{
    const struct runview *v = &l->view;

    for (; l->n < n; l->n += 2) {
        int i = l->n;
        pair part = 1. / (pair) { i + 1, i + 2 };
        pair wanted = pair_load(v->wanted + i) - v->start;
        pair error = pair_load(v->error + i);
        pair_store(l->low + i, (wanted - error) * part);
        pair_store(l->high + i, (wanted + error) * part);
    }
}

/* Returns 0, and changes nothing, if no line gets through.  Upside down a gate
 * is one of the other side. */
static inline int
pass_both(struct side *steep, struct side *flat, int i, double gate_low,
          double gate_high)
{
    struct point low = { i, gate_low }, high = { i, gate_high };
    struct point mirror_low = { i, -gate_high }, mirror_high = { i, -gate_low };

    if (low.y > get_height(steep, i) || mirror_low.y > get_height(flat, i))
        return 0;
    pass(steep, &low, &high);
    pass(flat, &mirror_low, &mirror_high);
    return 1;
}

int
runline_aim(struct runline *l, int n, int every, double *slope)
{
    struct side steep, flat;
    int i = 2 * every;

    *slope = 0.;
    if (n <= every)
        return n;
    fill(l, every + 1);
    start_side(&steep, every, l->low[0], l->low[every], l->high[every]);
    start_side(&flat, every, -l->high[0], -l->high[every], -l->low[every]);
    for (; i < n; i += every) {
        if (i >= l->n)
            fill(l, i + BLOCK < n ? i + BLOCK : n);
        if (!pass_both(&steep, &flat, i, l->low[i], l->high[i]))
            break;
    }
    *slope = .5 * (steep.slope - flat.slope);
    return i < n ? i : n;
}

/* ---- Whole numbers ---- */

struct bounds {
    double least, most;
};

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
has_whole(const struct bounds *b)
{
    return get_whole(b->least) <= b->most * (1. + SLACK);
}

/* Bounds that a block of gates leaves to the interval. */
static inline struct bounds
pass_block(const struct runline *l, int i, double half, struct bounds b)
{
    pair least = pair_of(b.least), most = pair_of(b.most);
    pair bend = half * (pair) { i, i + 1 }, more = pair_of(2. * half);

    for (int k = i; k < i + BLOCK; k += 2, bend += more) {
        least = pair_max(pair_load(l->low + k) - bend, least);
        most = pair_min(pair_load(l->high + k) - bend, most);
    }
    return (struct bounds) {
        least[0] > least[1] ? least[0] : least[1],
        most[0] < most[1] ? most[0] : most[1],
    };
}

static inline struct bounds
pass_one(const struct runline *l, int i, double half, struct bounds b)
{
    double bend = half * i;

    return (struct bounds) {
        l->low[i] - bend > b.least ? l->low[i] - bend : b.least,
        l->high[i] - bend < b.most ? l->high[i] - bend : b.most,
    };
}

int
runline_find_intervals(struct runline *l, double add, int n, double *least,
                       double *most)
{
    struct bounds b = { 1., UINT32_MAX }, next;
    int i = 0;

    fill(l, n);
    for (; i + BLOCK <= n; i += BLOCK, b = next) {
        next = pass_block(l, i, .5 * add, b);
        if (!has_whole(&next))
            break;
    }
    for (; i < n; i++, b = next) {
        next = pass_one(l, i, .5 * add, b);
        if (!has_whole(&next))
            break;
    }
    *least = get_whole(b.least);
    *most = floor(b.most * (1. + SLACK));
    return i;
}
