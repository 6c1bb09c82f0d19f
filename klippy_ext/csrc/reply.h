/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What an average over time makes of a plan that changes at one moment.
 *
 * The average has impulses, a smooth kernel, or neither; on top of it may lie a
 * mean whose weight rises linearly over `half` s and falls as long.  Of a step
 * at time 0 it makes a spline: at each of a few events, `delay` s after the
 * step, a polynomial in the time since that event is added.  What it makes of
 * a bend (a ramp that begins at 0), of a parabola and so on are integrals of
 * that.
 */
#ifndef REPLY_H
#define REPLY_H

#include <math.h>

enum {
    SHAPER_IMPULSES_MAX = 5,
    SHAPER_COEFFS_MAX = 12,
    REPLY_EVENTS_MAX = 3 * SHAPER_IMPULSES_MAX,
    REPLY_SIZE = SHAPER_COEFFS_MAX + 3,         /* powers of a step's reply */
    KINK_SIZE = 5,              /* powers of a plan, and of what jumps in it */
    POLY_SIZE = REPLY_SIZE + KINK_SIZE - 1,     /* of any */
};

/* Neither impulses nor coefficients: no average. */
struct shaper_axis {
    int n_impulses;
    double weights[SHAPER_IMPULSES_MAX];        /* their sum is 1 */
    double delays[SHAPER_IMPULSES_MAX];         /* s */
    int n_coeffs;
    double coeffs[SHAPER_COEFFS_MAX];   /* of w by power of u; integral 1 */
    double half;                        /* s */
};

struct reply_event {
    double delay;               /* s; may be negative */
    int low, high;              /* powers of c that are not 0 */
    double c[REPLY_SIZE];       /* of a step of height 1 */
};

struct reply {
    int n_events, degree;       /* of replies to parabolas */
    double means[KINK_SIZE];    /* of the powers of the delay (s) */
    struct reply_event events[REPLY_EVENTS_MAX];
};

/* 0 if what is set is a mean (the sum of weights is 1), or -EINVAL. */
int shaper_axis_check(const struct shaper_axis *shaper);
/* half: s, of the mean on top; 0 for none. */
void reply_make(struct reply *r, const struct shaper_axis *shaper,
                double half);
/* How far (s) before and after a time the average looks. */
double reply_get_pre(const struct reply *r);
double reply_get_post(const struct reply *r);
void reply_add_spline(const struct reply_event *e,
                      const double jump[KINK_SIZE], int n,
                      double q[POLY_SIZE]);
/* 0, or a negative number that says which invariant does not hold. */
int reply_check(const struct reply *r);

/* Add to q, by power of the time since event `e`, what that adds to the reply
 * to jump[i] * t^i, of which the first n, 3 or KINK_SIZE, count. */
static inline void
reply_add(const struct reply_event *e, const double jump[KINK_SIZE], int n,
          double q[POLY_SIZE])
{
    double weight = e->c[0];

    if (e->high > 0 || n > 3) {
        reply_add_spline(e, jump, n, q);
        return;
    }
    q[0] += weight * jump[0];           /* an impulse */
    q[1] += weight * jump[1];
    q[2] += weight * jump[2];
}

/* The same polynomial of degree n in a time that is `by` less. */
static inline void
poly_shift(double *q, int n, double by)
{
    for (int k = 0; k < n; k++)
        for (int i = n - 1; i >= k; i--)
            q[i] += by * q[i + 1];
}

/* The degree of q if high powers that add up to `bound` or less, in times up to
 * `duration`, are left out. */
static inline int
poly_cut(const double *q, int n, double duration, double bound)
{
    double powers[POLY_SIZE], rest = 0.;

    powers[0] = 1.;
    for (int k = 1; k <= n; k++)
        powers[k] = powers[k - 1] * duration;
    while (n > 0 && (rest += fabs(q[n]) * powers[n]) <= bound)
        n--;
    return n;
}

static inline double
poly_get(const double *q, int n, double t)
{
    double value = q[n];

    for (int i = n - 1; i >= 0; i--)
        value = value * t + q[i];
    return value;
}

#endif
