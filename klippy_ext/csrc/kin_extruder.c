/* SPDX-License-Identifier: GPL-3.0-or-later
 * Filament drive with pressure advance.  See kin_extruder.h. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "kin_extruder.h"
#include "polysolve.h"

/* Position on a segment, in mm by power of the time from its start. */
struct piece {
    double p[3];
};

static double
get_position(const struct itersolve *is, const double pos[3])
{
    (void)is;
    return pos[0];
}

static const struct advance_setting *
find_setting(const struct kin_extruder *k, double print_time)
{
    int i = k->n_settings - 1;

    while (i > 0 && k->settings[i].print_time > print_time + 1e-9)
        i--;
    return &k->settings[i];
}

int
kin_extruder_set_advance(struct kin_extruder *k, double print_time,
                         double advance, double smooth_time)
{
    struct advance_setting *s = k->settings;
    double half = advance > 0. ? .5 * smooth_time : 0.;
    double reach = half;

    if (!isfinite(print_time + advance + smooth_time) || advance < 0.
        || smooth_time < 0.)
        return -EINVAL;
    while (k->n_settings > 1
           && s[k->n_settings - 1].print_time >= print_time)
        k->n_settings--;
    if (k->n_settings == KIN_EXTRUDER_SETTINGS)
        memmove(s, s + 1, (size_t)--k->n_settings * sizeof(*s));
    s[k->n_settings++] = (struct advance_setting) {
        print_time, advance, half,
    };
    for (int i = 0; i < k->n_settings; i++)
        reach = fmax(reach, s[i].half_smooth);
    k->is.scan_pre = k->is.scan_post = reach;
    return 0;
}

/* ---- Pieces ---- */

static int
has_piece(const struct trapq *tq, uint64_t number)
{
    return number >= tq->oldest && number < tq->end;
}

/* Before the first and after the last segment the filament rests. */
static struct piece
get_piece(const struct kin_extruder *k, uint64_t number)
{
    const struct trapq *tq = k->is.tq;
    const struct trapseg *seg;
    double r, lead;

    if (!has_piece(tq, number)) {
        seg = trapq_get(tq, tq->end - 1);
        return (struct piece) { { seg->start[0] + seg->axes_r[0]
            * trapseg_get_distance(seg, seg->duration), 0., 0. } };
    }
    seg = trapq_get(tq, number);
    r = seg->axes_r[0];
    lead = seg->axes_r[1] != 0. ? find_setting(k, seg->time)->advance : 0.;
    return (struct piece) { {
        seg->start[0] + r * lead * seg->start_v,
        r * (seg->start_v + 2. * lead * seg->half_accel),
        r * seg->half_accel,
    } };
}

static double
get_border(const struct trapq *tq, uint64_t number)
{
    return number < tq->end ? trapq_get(tq, number)->time : tq->end_time;
}

/* What changes at the start of segment `number`: position (of the lead only),
 * velocity, half acceleration; in mm by power of the time after. */
static struct piece
get_change(const struct kin_extruder *k, uint64_t number)
{
    const struct trapseg *seg = trapq_get(k->is.tq, number - 1);
    struct piece a = get_piece(k, number - 1), b = get_piece(k, number);
    double t = seg->duration, nominal_a, nominal_b = b.p[0];

    nominal_a = seg->start[0]
        + seg->axes_r[0] * trapseg_get_distance(seg, t);
    if (has_piece(k->is.tq, number))
        nominal_b = trapq_get(k->is.tq, number)->start[0];
    return (struct piece) { {
        (b.p[0] - nominal_b)
            - (a.p[0] + (a.p[1] + a.p[2] * t) * t - nominal_a),
        b.p[1] - (a.p[1] + 2. * a.p[2] * t),
        b.p[2] - a.p[2],
    } };
}

/* ---- The average ---- */

/* Add factor * (reach + sign * t)^power to the polynomial q in t. */
static void
add_power(double q[5], double factor, double reach, double sign, int power)
{
    double term = factor;       /* of t^power, then down */

    for (int i = 0; i < power; i++)
        term *= sign;
    for (int i = power; i >= 0; i--) {
        q[i] += term;
        term *= reach * sign * i / (power - i + 1);
    }
}

/* A border within the window, which reaches `reach` beyond it at t = 0; side
 * is 1 for borders ahead, -1 for those behind the middle. */
static void
add_border(double q[5], const struct piece *change, double reach, double side,
           double half)
{
    double scale = side / (half * half);

    add_power(q, scale * change->p[0] / 2., reach, side, 2);
    add_power(q, scale * change->p[1] * side / 6., reach, side, 3);
    add_power(q, scale * change->p[2] / 12., reach, side, 4);
}

/* Numbers of the segments at both ends and in the middle of the window. */
struct window {
    uint64_t first, middle, last;
};

static void
make_average(const struct kin_extruder *k, const struct window *w,
             double time, double half, struct quartic *q)
{
    const struct trapq *tq = k->is.tq;
    struct piece c = get_piece(k, w->middle), change;
    double t = time - get_border(tq, w->middle);

    q->time = time;
    q->p[0] = c.p[0] + (c.p[1] + c.p[2] * t) * t
        + c.p[2] * half * half / 6.;
    q->p[1] = c.p[1] + 2. * c.p[2] * t;
    q->p[2] = c.p[2];
    q->p[3] = q->p[4] = 0.;
    for (uint64_t i = w->first + 1; i <= w->last; i++) {
        double border = get_border(tq, i);
        double side = i > w->middle ? 1. : -1.;
        change = get_change(k, i);
        add_border(q->p, &change, half + side * (time - border), side, half);
    }
    q->p[0] -= k->is.origin;
    for (int i = 0; i < 5; i++)
        q->p[i] *= k->is.inv_step_dist;
}

static double
get_piece_end(const struct trapq *tq, uint64_t number)
{
    return number < tq->end ? trapseg_get_end(trapq_get(tq, number))
                            : INFINITY;
}

/* The steps from `time` until the window meets the next border, but not after
 * `end`; returns that time in *until. */
static int
emit_window(struct kin_extruder *k, struct window *w, double time, double end,
            double half, double *until)
{
    const struct trapq *tq = k->is.tq;
    struct quartic q;

    w->first = trapq_find(tq, w->first, time - half);
    w->middle = trapq_find(tq, w->middle, time);
    w->last = trapq_find(tq, w->last, time + half);
    *until = fmin(fmin(end, get_piece_end(tq, w->middle)),
                  fmin(get_piece_end(tq, w->first) + half,
                       get_piece_end(tq, w->last) - half));
    if (*until <= time)         /* rounding: the borders nearly meet */
        *until = fmin(nextafter(time, INFINITY), end);
    if (w->first == w->last && (w->first == tq->end || trapseg_is_rest(
                                    trapq_get(tq, w->first))))
        return 0;
    make_average(k, w, time, half, &q);
    if (w->first == w->last) {
        struct quadratic plain = { time, q.p[0], q.p[1], q.p[2] };
        return itersolve_emit_quadratic(&k->is, &plain, 0., *until - time);
    }
    return polysolve_emit(&k->is, &q, *until - time);
}

/* Without advance: the plain position. */
static int
emit_plain(struct kin_extruder *k, const struct window *w, double time,
           double end)
{
    const struct trapseg *seg = trapq_get(k->is.tq, w->middle);
    double ratio = seg->axes_r[0] * k->is.inv_step_dist;
    struct quadratic q = {
        .time = seg->time,
        .p0 = itersolve_to_steps(&k->is, seg->start[0]),
        .p1 = ratio * seg->start_v, .p2 = ratio * seg->half_accel,
    };

    if (ratio == 0. || trapseg_is_rest(seg))
        return 0;
    return itersolve_emit_quadratic(&k->is, &q, time - seg->time,
                                    end - seg->time);
}

/* Half the window at a time, and until when that is so.  While the window
 * holds segments of two settings the longer one serves both, so that a change
 * comes gradually. */
static double
get_half(const struct kin_extruder *k, double time, double *until)
{
    double half = 0., reach = k->is.scan_post;

    for (int i = 0; i < k->n_settings; i++) {
        const struct advance_setting *s = &k->settings[i];
        double from = i ? s->print_time - reach : -INFINITY;
        double to = i + 1 < k->n_settings ? s[1].print_time + reach : INFINITY;
        if (from > time)
            *until = fmin(*until, from);
        else if (to > time) {
            half = fmax(half, s->half_smooth);
            *until = fmin(*until, to);
        }
    }
    return half;
}

static int
emit_range(struct itersolve *is, double start, double end)
{
    struct kin_extruder *k = (struct kin_extruder *)is;
    struct window w = { is->cursor, is->cursor, is->cursor };
    double time = start;
    int ret = 0;

    while (time < end && !ret) {
        double until = end, half = get_half(k, time, &until);
        if (half > 0.) {
            ret = emit_window(k, &w, time, until, half, &until);
        } else {
            w.middle = trapq_find(is->tq, w.middle, time);
            if (w.middle == is->tq->end)
                break;
            until = fmin(until, get_piece_end(is->tq, w.middle));
            ret = emit_plain(k, &w, time, until);
        }
        time = until;
    }
    is->cursor = w.middle;
    return ret;
}

static const struct itersolve_kind kind = {
    .get_position = get_position, .emit_range = emit_range,
};

struct kin_extruder *
kin_extruder_new(void)
{
    struct kin_extruder *k = calloc(1, sizeof(*k));

    if (!k)
        return NULL;
    k->n_settings = 1;
    itersolve_init(&k->is, &kind, ITERSOLVE_X);
    return k;
}
