/* SPDX-License-Identifier: GPL-3.0-or-later
 * Shaped paths near a centre.  See shapercore.h. */
#include <math.h>

#include "shaper.h"
#include "shapercore.h"

#define PI 3.14159265358979323846
/* The border of the core is looked for in steps of at least so long (s), and
 * found to this. */
#define SEARCH_STEP 1e-6
#define FOUND 1e-10

/* Place and velocity of the head. */
struct head {
    double x, y, vx, vy;
};

/* A way out of the core. */
struct turn {
    struct itersolve *is;
    double from, change;        /* angle where it begins; about how far */
    double near;                /* mm from the centre there */
};

static double
get_slope(const double *q, int n, double t)
{
    double value = n * q[n];

    for (int i = n - 1; i > 0; i--)
        value = value * t + i * q[i];
    return value;
}

static struct head
find_head(const struct itersolve *is, double time)
{
    const struct kinkpath *k = &is->path->kinks;
    double t = time - k->time;

    return (struct head) {
        poly_get(k->q[0], k->degree, t), poly_get(k->q[1], k->degree, t),
        get_slope(k->q[0], k->degree, t), get_slope(k->q[1], k->degree, t),
    };
}

/* How far the head is outside of the core (mm); below 0 inside. */
static double
find_gap(const struct itersolve *is, double time)
{
    struct head h = find_head(is, time);

    return hypot(h.x, h.y) - is->kind->core;
}

/* Above 0 where the head goes away from the centre. */
static double
find_rise(const struct itersolve *is, double time)
{
    struct head h = find_head(is, time);

    return h.x * h.vx + h.y * h.vy;
}

/* When f changes its sign, once between two times. */
static double
find_change(double (*f)(const struct itersolve *, double),
            const struct itersolve *is, double low, double high)
{
    int sign = f(is, low) > 0.;

    while (high - low > FOUND) {
        double middle = .5 * (low + high);
        if ((f(is, middle) > 0.) == sign)
            low = middle;
        else
            high = middle;
    }
    return high;
}

/* No speed up to a time is higher. */
static double
find_top_speed(const struct kinkpath *k, double until)
{
    double tops[2] = { 0. }, t = until - k->time;

    for (int i = 0; i < 2; i++)
        for (int n = k->degree; n > 0; n--)
            tops[i] = tops[i] * t + n * fabs(k->q[i][n]);
    return hypot(tops[0], tops[1]);
}

/* When the head next meets the border of the core, at `until` at the latest. */
static double
find_border(const struct itersolve *is, double time, double until)
{
    double speed = find_top_speed(&is->path->kinks, until);
    double gap = find_gap(is, time);

    while (time < until) {
        double next = time + fmax(fabs(gap) / speed, SEARCH_STEP), next_gap;
        if (!(next < until))
            return until;
        next_gap = find_gap(is, next);
        if ((gap > 0.) != (next_gap > 0.))
            return find_change(find_gap, is, time, next);
        time = next;
        gap = next_gap;
    }
    return until;
}

/* By how much the bed must still turn where the line on which the head is
 * leaves the core. */
static double
find_way(const struct turn *turn, double time)
{
    struct head h = find_head(turn->is, time);
    double core = turn->is->kind->core, speed = hypot(h.vx, h.vy);
    double along, rest2, ahead;

    if (speed > 0.) {
        along = (h.x * h.vx + h.y * h.vy) / speed;
        rest2 = core * core - h.x * h.x - h.y * h.y + along * along;
        ahead = (sqrt(fmax(rest2, 0.)) - along) / speed;
        h.x += ahead * h.vx;
        h.y += ahead * h.vy;
    }
    return remainder(atan2(h.y, h.x) - turn->from, 2. * PI);
}

static double
get_turn(void *data, double time)
{
    const struct turn *turn = data;
    struct head h = find_head(turn->is, time);
    double core = turn->is->kind->core;
    double share = (hypot(h.x, h.y) - turn->near) / (core - turn->near);
    double way = find_way(turn, time);

    way = turn->change + remainder(way - turn->change, 2. * PI);
    return turn->from + fmin(fmax(share, 0.), 1.) * way;
}

/* Within the core all the time. */
static int
emit_core(struct itersolve *is, double time, double until)
{
    struct turn turn = { .is = is };
    double foot = time;

    if (find_rise(is, until) <= 0.)
        return 0;
    if (find_rise(is, time) <= 0.)
        foot = find_change(find_rise, is, time, until);
    turn.near = find_gap(is, foot) + is->kind->core;
    turn.from = itersolve_get_commanded_pos(is);
    turn.change = find_way(&turn, until);
    if (!(turn.near < is->kind->core))
        return 0;
    return shaperfit_emit(is, get_turn, &turn, 0., foot, until);
}

int
shapercore_emit(struct itersolve *is, shaperfit_get get, void *data,
                double time, double until)
{
    int ret = 0;

    while (time < until && !ret) {
        double next = find_border(is, time, until);
        if (find_gap(is, .5 * (time + next)) > 0.)
            ret = shaperfit_emit(is, get, data, is->kind->period, time,
                                 next);
        else
            ret = emit_core(is, time, next);
        time = next;
    }
    return ret;
}
