/* SPDX-License-Identifier: GPL-3.0-or-later
 * Windows of many steps.  See stepbatch.h. */
#include "stepbatch.h"

#define INLINE static inline __attribute__((always_inline))

/* More than any time between steps, of which half is more than any error. */
#define FAR 1e15

/* Clocks, not yet whole, of two steps by their number. */
typedef pair get_clocks(const void *data, pair number, int i);

/* The last two clocks, the times before them, and the least so far. */
struct passed {
    pair clocks, gaps, least;
};

/* Go on with two clocks; the errors of the one before and the first. */
INLINE pair
pass(struct passed *p, pair clocks, pair most)
{
    pair gaps = clocks - pair_join(p->clocks, clocks);
    pair room = pair_min(pair_join(p->gaps, gaps), gaps);

    p->clocks = clocks;
    p->gaps = gaps;
    p->least = pair_min(p->least, room);
    /* half of what is left without one, rounded down */
    return pair_round(pair_min(room, most) * .5 - .75);
}

/* odd: clock of the last step, if n is. */
INLINE int
fill(const struct stepbatch *b, get_clocks *get, const void *data, int n,
     double odd)
{
    double *clocks = b->clocks + 1, *errors = b->errors;
    pair most = pair_of(2. * b->max_error + 1.), number = { 0., 1. };
    struct passed p = {
        pair_of(b->clocks[0]), pair_of(b->before), pair_of(b->before),
    };
    int i = 0;

#pragma GCC unroll 2
    for (; i + 2 <= n; i += 2, number += 2.) {
        pair pairs = pair_round(get(data, number, i));
        pair_store(clocks + i, pairs);
        pair_store(errors + i, pass(&p, pairs, most));
    }
    if (i < n) {
        pair pairs = { odd, odd + FAR };
        pair_store(clocks + i, pairs);
        pair_store(errors + i, pass(&p, pairs, most));
    }
    return !pair_is_less(pair_compare(p.least, pair_of(1.)));
}

struct times {
    const double *times;
    double offset, freq;
};

INLINE pair
get_time(const void *data, pair number, int i)
{
    const struct times *t = data;

    (void)number;
    return (pair_load(t->times + i) - t->offset) * t->freq;
}

INLINE pair
get_even(const void *data, pair number, int i)
{
    (void)i;
    return stepticks_get_even(data, number);
}

INLINE pair
get_bent(const void *data, pair number, int i)
{
    (void)i;
    return stepticks_get_bent(data, number);
}

int
stepbatch_set_times(const struct stepbatch *b, const double *times, int n)
{
    struct times t = { times, b->scale.offset, b->scale.freq };

    return fill(b, get_time, &t, n,
                stepscale_get_clock(&b->scale, times[n - 1]));
}

int
stepbatch_set_way(const struct stepbatch *b, const struct stepway *w,
                  int64_t done, int n)
{
    struct stepticks t = stepway_get_ticks(w, &b->scale, (double)done);
    double odd = n & 1 ? stepway_get_clock(w, &b->scale,
                                           (double)(done + n - 1)) : 0.;

    return t.four == 0. ? fill(b, get_even, &t, n, odd)
        : fill(b, get_bent, &t, n, odd);
}
