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

/* ---- Settings ---- */

static const struct advance_setting *
find_setting(const struct kin_extruder *k, double print_time)
{
    int i = k->n_settings - 1;

    while (i > 0 && k->settings[i].print_time > print_time + 1e-9)
        i--;
    return &k->settings[i];
}

/* Window of two settings that follow each other: the longer serves both. */
static double
get_reach(const struct advance_setting *s)
{
    return fmax(s[0].half_smooth, s[1].half_smooth);
}

/* Forget settings that serve no segment any more. */
static void
prune_settings(struct kin_extruder *k)
{
    struct advance_setting *s = k->settings;
    const struct trapq *tq = k->is.tq;
    double needed = k->is.done_time - k->is.scan_pre;
    int n = 0;

    if (tq && !trapq_is_empty(tq)) {
        uint64_t i = trapq_find(tq, k->is.cursor, needed);
        if (i < tq->end)
            needed = fmin(needed, trapq_get(tq, i)->time);
    }
    while (n + 1 < k->n_settings
           && s[n + 1].print_time + get_reach(&s[n]) < needed)
        n++;
    if (k->n_settings - n == KIN_EXTRUDER_SETTINGS)
        n++;
    k->n_settings -= n;
    memmove(s, s + n, (size_t)k->n_settings * sizeof(*s));
}

int
kin_extruder_set_advance(struct kin_extruder *k, double print_time,
                         double advance, double smooth_time)
{
    struct advance_setting *s = k->settings, *last;
    double half = advance > 0. ? .5 * smooth_time : 0., reach = 0.;

    if (!isfinite(print_time + advance + smooth_time) || advance < 0.
        || smooth_time < 0.)
        return -EINVAL;
    advance = half > 0. ? advance : 0.;
    while (k->n_settings > 1
           && s[k->n_settings - 1].print_time >= print_time)
        k->n_settings--;
    prune_settings(k);
    last = &s[k->n_settings - 1];
    if (last->advance != advance || last->half_smooth != half)
        s[k->n_settings++] = (struct advance_setting) {
            print_time, advance, half,
        };
    for (int i = 0; i < k->n_settings; i++)
        reach = fmax(reach, s[i].half_smooth);
    k->is.scan_pre = k->is.scan_post = reach;
    return 0;
}

/* Half the window at a time; *until is lowered to when that may change. */
static double
get_half(const struct kin_extruder *k, double time, double *until)
{
    const struct advance_setting *s = k->settings;
    double half = 0.;

    for (int i = k->n_settings - 1; i >= 0; i--) {
        double from = i ? s[i].print_time - get_reach(&s[i - 1]) : -INFINITY;
        double to = i + 1 < k->n_settings
            ? s[i + 1].print_time + get_reach(&s[i]) : INFINITY;
        if (from > time) {
            *until = fmin(*until, from);
            continue;
        }
        if (to > time) {
            half = fmax(half, s[i].half_smooth);
            *until = fmin(*until, to);
        }
    }
    return half;
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

/* In mm, by power of the time after `time`. */
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
}

static double
get_piece_end(const struct trapq *tq, uint64_t number)
{
    return number < tq->end ? trapseg_get_end(trapq_get(tq, number))
                            : INFINITY;
}

/* Move the window to `time`.  Returns when it meets the next border. */
static double
move_window(const struct trapq *tq, struct window *w, double time, double half)
{
    w->first = trapq_find(tq, w->first, time - half);
    w->middle = trapq_find(tq, w->middle, time);
    w->last = trapq_find(tq, w->last, time + half);
    return fmin(get_piece_end(tq, w->middle),
                fmin(get_piece_end(tq, w->first) + half,
                     get_piece_end(tq, w->last) - half));
}

static int
is_at_rest(const struct trapq *tq, const struct window *w)
{
    return w->first == w->last && (w->first == tq->end || trapseg_is_rest(
                                       trapq_get(tq, w->first)));
}

static double
get_faded(const struct fading *f, double time)
{
    return time < f->end ? f->offset * (f->end - time) / (f->end - f->start)
                         : 0.;
}

/* The window's length changes at `time`: keep the position as it is. */
static void
change_half(struct kin_extruder *k, struct window *w, double time, double half)
{
    double offset = get_faded(&k->fading, time), longer = fmax(k->half, half);
    struct quartic q;

    move_window(k->is.tq, w, time, k->half);
    make_average(k, w, time, k->half, &q);
    offset += q.p[0];
    move_window(k->is.tq, w, time, half);
    make_average(k, w, time, half, &q);
    offset -= q.p[0];
    k->fading = (struct fading) { offset, time, time + longer };
    k->half = half;
}

/* To steps, with the offset that fades. */
static void
place_average(const struct kin_extruder *k, struct quartic *q)
{
    const struct fading *f = &k->fading;

    q->p[0] += get_faded(f, q->time) - k->is.origin;
    if (q->time < f->end)
        q->p[1] -= f->offset / (f->end - f->start);
    for (int i = 0; i < 5; i++)
        q->p[i] *= k->is.inv_step_dist;
}

/* The steps from `time` to `end`, between which the window meets no border. */
static int
emit_window(struct kin_extruder *k, const struct window *w, double time,
            double end)
{
    struct quartic q;

    if (is_at_rest(k->is.tq, w) && time >= k->fading.end)
        return 0;
    make_average(k, w, time, k->half, &q);
    place_average(k, &q);
    if (w->first == w->last) {
        struct quadratic plain = { time, q.p[0], q.p[1], q.p[2] };
        return itersolve_emit_quadratic(&k->is, &plain, 0., end - time);
    }
    return polysolve_emit(&k->is, &q, end - time);
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
        if (half != k->half)
            change_half(k, &w, time, half);
        if (time < k->fading.end)
            until = fmin(until, k->fading.end);
        until = fmin(until, move_window(is->tq, &w, time, half));
        if (until <= time)      /* rounding: the borders nearly meet */
            until = fmin(nextafter(time, INFINITY), end);
        ret = emit_window(k, &w, time, until);
        time = until;
    }
    is->cursor = w.first;
    return ret;
}

static int
check(const struct itersolve *is)
{
    const struct kin_extruder *k = (const struct kin_extruder *)is;
    const struct advance_setting *s = k->settings;

    if (k->n_settings < 1 || k->n_settings > KIN_EXTRUDER_SETTINGS)
        return -20;
    for (int i = 2; i < k->n_settings; i++)
        if (s[i].print_time <= s[i - 1].print_time)
            return -21;
    for (int i = 0; i < k->n_settings; i++)
        if (s[i].advance < 0. || s[i].half_smooth > k->is.scan_pre)
            return -22;
    if (!isfinite(k->fading.offset) || k->fading.end < k->fading.start)
        return -23;
    return 0;
}

static const struct itersolve_kind kind = {
    .get_position = get_position, .emit_range = emit_range, .check = check,
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
