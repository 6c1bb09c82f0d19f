/* SPDX-License-Identifier: GPL-3.0-or-later
 * Steps of polynomials.  See polysolve.h. */
#include <math.h>

#include "polysolve.h"

/* Tolerance of times (s) and the most rounds to get there. */
#define TIME_EPSILON 1e-12
enum { ROUNDS_MAX = 60, BATCH = 64 };

static double
get_value(const double p[5], double t)
{
    return p[0] + t * (p[1] + t * (p[2] + t * (p[3] + t * p[4])));
}

static double
get_slope(const double p[5], double t)
{
    return p[1] + t * (2. * p[2] + t * (3. * p[3] + t * 4. * p[4]));
}

static double
get_bend(const double p[5], double t)
{
    return 2. * p[2] + t * (6. * p[3] + t * 12. * p[4]);
}

/* The t in [low, high] at which f comes to `level`, where dir * f rises.
 * Newton's step, replaced by halving when it leaves what is left. */
static double
solve(double (*f)(const double *, double), double (*slope)(const double *,
                                                           double),
      const double p[5], double level, int dir, double low, double high,
      double guess)
{
    double t = guess;

    for (int i = 0; i < ROUNDS_MAX && high - low > TIME_EPSILON; i++) {
        double off = dir * (f(p, t) - level);
        double rate = dir * slope(p, t), next;
        if (off > 0.)
            high = t;
        else
            low = t;
        next = t - off / rate;
        if (!(next > low && next < high))
            next = .5 * (low + high);
        if (fabs(next - t) < TIME_EPSILON)
            return next;
        t = next;
    }
    return t;
}

static int
emit_monotone(struct itersolve *is, const struct quartic *q, double from,
              double to)
{
    double begin = get_value(q->p, from), end = get_value(q->p, to);
    int dir = end >= begin ? 1 : -1;
    int ret = itersolve_align(is, q->time + from, begin);
    int64_t count = itersolve_count_to(is, end, dir);
    double t = from;

    while (count > 0 && !ret) {
        double times[BATCH];
        int n = count < BATCH ? (int)count : BATCH;
        for (int i = 0; i < n; i++) {
            double level = itersolve_get_level(is, i, dir);
            double speed = dir * get_slope(q->p, t);
            double way = dir * (level - get_value(q->p, t));
            double inside = speed * speed
                + 2. * dir * get_bend(q->p, t) * way;
            double guess = t + 2. * way
                / (speed + sqrt(fmax(inside, 0.)) + 1e-300);
            if (!(guess >= t && guess <= to))
                guess = .5 * (t + to);
            t = way > 0. ? solve(get_value, get_slope, q->p, level, dir, t,
                                 to, guess) : t;
            times[i] = q->time + t;
        }
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

/* Times at which the direction changes, in order; at most 3. */
static int
find_turns(const double p[5], double duration, double *turns)
{
    double edges[4] = { 0. };
    int n_edges = 1, n = 0;

    n_edges += find_zeros(2. * p[2], 6. * p[3], 12. * p[4], duration,
                          edges + 1);
    edges[n_edges] = duration;
    for (int i = 0; i < n_edges; i++) {
        double before = get_slope(p, edges[i]);
        double after = get_slope(p, edges[i + 1]);
        if ((before < 0.) == (after < 0.))
            continue;
        turns[n++] = solve(get_slope, get_bend, p, 0.,
                           after > before ? 1 : -1, edges[i], edges[i + 1],
                           .5 * (edges[i] + edges[i + 1]));
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
