/* SPDX-License-Identifier: GPL-3.0-or-later
 * Steps of polynomials.  See polysolve.h. */
#include <math.h>

#include "pair.h"
#include "polysolve.h"

/* Tolerance of times (s) and the most rounds to get there. */
#define TIME_EPSILON 1e-12
enum { ROUNDS_MAX = 60, ROUNDS_BATCH = 3, BATCH = 64 };

static inline double
get_value(const double p[5], double t)
{
    return p[0] + t * (p[1] + t * (p[2] + t * (p[3] + t * p[4])));
}

static inline double
get_slope(const double p[5], double t)
{
    return p[1] + t * (2. * p[2] + t * (3. * p[3] + t * 4. * p[4]));
}

static inline double
get_bend(const double p[5], double t)
{
    return 2. * p[2] + t * (6. * p[3] + t * 12. * p[4]);
}

/* How far off (s) a step of Newton's may leave a root: bend is more than the
 * second derivative anywhere. */
static inline int
is_near(double by, double rate, double bend)
{
    return by * by * bend <= 2. * TIME_EPSILON * fabs(rate)
        || fabs(by) <= TIME_EPSILON;
}

/* The t in [low, high] at which p, which rises there, comes to `level`.
 * Newton's step, replaced by halving when it leaves what is left. */
static double
solve(const double p[5], double level, double low, double high,
      double guess, double bend)
{
    double t = guess;

    for (int i = 0; i < ROUNDS_MAX && high - low > TIME_EPSILON; i++) {
        double off = get_value(p, t) - level;
        double rate = get_slope(p, t), by;
        if (off > 0.)
            high = t;
        else
            low = t;
        by = -off / rate;
        if (t + by >= low && t + by <= high && is_near(by, rate, bend))
            return t + by;
        t = t + by > low && t + by < high ? t + by : .5 * (low + high);
    }
    return t;
}

/* More than the second derivative is anywhere up to `to`. */
static double
find_bend(const double p[5], double to)
{
    return 2. * fabs(p[2])
        + to * (6. * fabs(p[3]) + to * 12. * fabs(p[4]));
}

/* As get_value() and get_slope(). */
static inline pair
get_values(const double p[5], pair t, pair *slope)
{
    pair value = p[3] + p[4] * t, rate = value + p[4] * t;

    value = p[2] + value * t;
    rate = value + rate * t;
    value = p[1] + value * t;
    *slope = value + rate * t;
    return p[0] + value * t;
}

/* Newton's steps to where p comes to two levels.  Those whose signs are set are
 * not yet near enough. */
static inline pair
approach(const double p[5], pair level, pair t, double from, double to,
         double bend, pair_mask *signs)
{
    for (int round = 0; round < ROUNDS_BATCH; round++) {
        pair at = pair_min(pair_max(t, pair_of(from)), pair_of(to)), rate;
        pair by = level - get_values(p, at, &rate);
        by /= rate;
        t = at + by;
        *signs = pair_compare(2. * TIME_EPSILON * rate, by * by * bend);
        if (!pair_is_less(*signs))
            break;
    }
    return t;
}

/* Times in [from, to] at which p, which rises there, comes to first, first + 1,
 * ...  One more may be written. */
static void
solve_batch(double *t, int n, const double p[5], double first, double from,
            double to, double bend)
{
    double begin = get_value(p, from), speed = get_slope(p, from), low = from;
    double twice = 2. * get_bend(p, from), speed2 = speed * speed;
    pair number = { 0., 1. };

    for (int i = 0; i < n; i += 2, number += 2.) {
        pair level = number + first, way = level - begin, guess;
        pair_mask signs;
        guess = pair_sqrt(pair_max(speed2 + twice * way, pair_of(0.)));
        guess = from + (way + way) / (guess + (speed + 1e-300));
        pair_store(t + i, approach(p, level, guess, from, to, bend, &signs));
        for (int k = i; k < i + 2 && k < n; k++) {
            if (signs[k - i] < 0 || !(t[k] >= low && t[k] <= to))
                t[k] = solve(p, first + (double)k, low, to, .5 * (low + to),
                             bend);
            low = t[k];
        }
    }
}

static int
emit_monotone(struct itersolve *is, const struct quartic *q, double from,
              double to)
{
    double begin = get_value(q->p, from), end = get_value(q->p, to);
    int dir = end >= begin ? 1 : -1;
    int ret = itersolve_align(is, q->time + from, begin);
    int64_t count = itersolve_count_to(is, end, dir);
    double t = from, bend = find_bend(q->p, to), p[5];

    for (int i = 0; i < 5; i++)
        p[i] = dir * q->p[i];
    while (count > 0 && !ret) {
        double times[BATCH];
        int n = count < BATCH ? (int)count : BATCH;
        solve_batch(times, n, p, dir * itersolve_get_level(is, 0, dir), t,
                    to, bend);
        t = times[n - 1];
        for (int i = 0; i < n; i++)
            times[i] += q->time;
        count -= n;
        ret = itersolve_push(is, times, n, dir);
    }
    return ret;
}

/* Zeros of a + b * t + c * t^2 within (0, duration), in order. */
static int
find_zeros(double a, double b, double c, double duration, double zeros[2])
{
    double inside = b * b - 4. * a * c, half, x[2];
    int n = 0;

    if (inside < 0.)
        return 0;
    half = -.5 * (b + copysign(sqrt(inside), b));
    x[0] = c != 0. ? half / c : -1.;
    x[1] = half != 0. ? a / half : -1.;
    if (x[0] > x[1]) {
        double swap = x[0];
        x[0] = x[1];
        x[1] = swap;
    }
    for (int i = 0; i < 2; i++)
        if (x[i] > 0. && x[i] < duration)
            zeros[n++] = x[i];
    return n;
}

/* The time at which the direction changes, once between two. */
static double
find_turn(const double p[5], double low, double high)
{
    /* The slope as a polynomial of its own */
    double slope[5] = { p[1], 2. * p[2], 3. * p[3], 4. * p[4], 0. };

    if (get_value(slope, high) < get_value(slope, low))
        for (int i = 0; i < 4; i++)
            slope[i] = -slope[i];
    return solve(slope, 0., low, high, .5 * (low + high),
                 find_bend(slope, high));
}

/* Times at which the direction changes, in order; at most 3. */
static int
find_turns(const double p[5], double duration, double *turns)
{
    double edges[4] = { 0. };
    int n_edges = 1, n = 0;

    if (fabs(p[1]) > duration * find_bend(p, duration))
        return 0;
    n_edges += find_zeros(2. * p[2], 6. * p[3], 12. * p[4], duration,
                          edges + 1);
    edges[n_edges] = duration;
    for (int i = 0; i < n_edges; i++) {
        double before = get_slope(p, edges[i]);
        double after = get_slope(p, edges[i + 1]);
        if ((before < 0.) == (after < 0.))
            continue;
        turns[n++] = find_turn(p, edges[i], edges[i + 1]);
    }
    return n;
}

int
polysolve_emit(struct itersolve *is, const struct quartic *q, double duration)
{
    double turns[4], from = 0.;
    int ret = 0, n = find_turns(q->p, duration, turns);

    turns[n] = duration;
    for (int i = 0; i <= n && !ret; i++) {
        ret = emit_monotone(is, q, from, turns[i]);
        from = turns[i];
    }
    return ret;
}
