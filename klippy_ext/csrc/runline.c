/* SPDX-License-Identifier: GPL-3.0-or-later
 * How far a line gets.  See runline.h. */
#include "runline.h"

enum { BLOCK = 16 };

struct gate {
    double low, high;
};

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
start_side(struct side *s, double low0, double low1, double high1)
{
    s->hull[0] = (struct point) { 0., low0 };
    s->hull[1] = (struct point) { 1., low1 };
    s->first = 0;
    s->end = 2;
    s->slope = high1 - low0;
    s->upper = (struct point) { 1., high1 };
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

/* Gates number first, first + 1, ... */
static void
set_gates(struct gate *gates, const int64_t *wanted, const uint32_t *error,
          int64_t start, int first, int n)
{
    for (int i = first; i < first + n; i++) {
        double part = 1. / (double)(i + 1);
        double middle = (double)(wanted[i] - start) * part;
        double half = (double)error[i] * part;
        gates[i - first] = (struct gate) { middle - half, middle + half };
    }
}

/* Returns 0, and changes nothing, if no line gets through.  Upside down a gate
 * is one of the other side. */
static inline int
pass_both(struct side *steep, struct side *flat, int i, struct gate g)
{
    struct point low = { i, g.low }, high = { i, g.high };
    struct point mirror_low = { i, -g.high }, mirror_high = { i, -g.low };

    if (low.y > get_height(steep, i) || mirror_low.y > get_height(flat, i))
        return 0;
    pass(steep, &low, &high);
    pass(flat, &mirror_low, &mirror_high);
    return 1;
}

int
runline_aim(const int64_t *wanted, const uint32_t *error, int64_t start,
            int n, double *slope)
{
    struct gate gates[BLOCK];
    struct side steep, flat;
    int i = 2;

    *slope = 0.;
    if (n < 2)
        return n;
    set_gates(gates, wanted, error, start, 0, 2);
    start_side(&steep, gates[0].low, gates[1].low, gates[1].high);
    start_side(&flat, -gates[0].high, -gates[1].high, -gates[1].low);
    for (; i < n; i++) {
        int k = (i - 2) % BLOCK;
        if (!k)
            set_gates(gates, wanted, error, start, i,
                      n - i < BLOCK ? n - i : BLOCK);
        if (!pass_both(&steep, &flat, i, gates[k]))
            break;
    }
    *slope = .5 * (steep.slope - flat.slope);
    return i;
}
