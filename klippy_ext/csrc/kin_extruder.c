/* SPDX-License-Identifier: GPL-3.0-or-later
 * Filament drive with pressure advance.  See kin_extruder.h. */
#include <math.h>
#include <stdlib.h>

#include "kin_extruder.h"

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

/* When the oldest segment begins that steps to come need. */
static double
find_needed(const struct kin_extruder *k)
{
    const struct trapq *tq = k->is.tq;
    double needed = k->is.done_time - k->is.scan_pre;
    uint64_t i;

    if (!tq || trapq_is_empty(tq))
        return needed;
    i = trapq_find(tq, k->is.cursor, needed);
    return i < tq->end ? fmin(needed, trapq_get(tq, i)->time) : needed;
}

int
kin_extruder_set_model(struct kin_extruder *k, double print_time,
                       const struct advance_model *model)
{
    int ret = advancelist_add(&k->settings, print_time, model,
                              find_needed(k));

    advancelist_get_scan(&k->settings, &k->is.scan_pre, &k->is.scan_post);
    return ret;
}

int
kin_extruder_set_advance(struct kin_extruder *k, double print_time,
                         double advance, double smooth_time)
{
    struct advance_model model = {
        .kind = ADVANCE_LINEAR, .linear = advance, .smooth_time = smooth_time,
    };

    return kin_extruder_set_model(k, print_time, &model);
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
    lead = seg->axes_r[1] != 0.
        ? advancelist_find(&k->settings, seg->time)->advance : 0.;
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

/* Velocity by which the lead goes, as above; no power of 2. */
static struct piece
get_speed_piece(const struct kin_extruder *k, uint64_t number)
{
    const struct trapseg *seg;
    double r;

    if (!has_piece(k->is.tq, number))
        return (struct piece) { { 0. } };
    seg = trapq_get(k->is.tq, number);
    r = seg->axes_r[1] != 0. ? seg->axes_r[0] : 0.;
    return (struct piece) { {
        r * seg->start_v, 2. * r * seg->half_accel, 0.,
    } };
}

static struct piece
get_speed_change(const struct kin_extruder *k, uint64_t number)
{
    double t = trapq_get(k->is.tq, number - 1)->duration;
    struct piece a = get_speed_piece(k, number - 1);
    struct piece b = get_speed_piece(k, number);

    return (struct piece) { {
        b.p[0] - (a.p[0] + a.p[1] * t), b.p[1] - a.p[1], 0.,
    } };
}

/* ---- The average ---- */

typedef struct piece (*piece_getter)(const struct kin_extruder *, uint64_t);

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

/* Of pieces, by power of the time after `time`. */
static inline void
make_average(const struct kin_extruder *k, const struct window *w,
             double time, double half, piece_getter get, piece_getter get_jump,
             struct quartic *q)
{
    const struct trapq *tq = k->is.tq;
    struct piece c = get(k, w->middle), change;
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
        change = get_jump(k, i);
        add_border(q->p, &change, half + side * (time - border), side, half);
    }
}

/* Position without bend, mm. */
static void
average_position(const struct kin_extruder *k, const struct window *w,
                 double time, double half, struct quartic *q)
{
    make_average(k, w, time, half, get_piece, get_change, q);
}

/* Velocity of what is led, mm/s. */
static void
average_speed(const struct kin_extruder *k, const struct window *w,
              double time, double half, struct quartic *q)
{
    make_average(k, w, time, half, get_speed_piece, get_speed_change, q);
}

static int
is_constant(const struct quartic *q)
{
    return q->p[1] == 0. && q->p[2] == 0. && q->p[3] == 0. && q->p[4] == 0.;
}

/* ---- Steps ---- */

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

/* Position at a time of the drive, mm. */
static double
find_position(const struct kin_extruder *k, struct window *w, double time,
              const struct advance_state *state)
{
    double motion = time + state->shift, position;
    struct quartic q;

    move_window(k->is.tq, w, motion, state->half);
    average_position(k, w, motion, state->half, &q);
    position = q.p[0];
    if (state->bend.offset != 0.) {
        average_speed(k, w, motion, state->half, &q);
        position += advancebend_get(&state->bend, q.p[0]);
    }
    return position;
}

/* Positions are made in another way from `time` on: keep the one there. */
static void
change_state(struct kin_extruder *k, struct window *w, double time,
             const struct advance_state *state)
{
    double longer = fmax(fmax(k->state.half, state->half),
                         2. * fabs(k->state.shift - state->shift));
    double offset = get_faded(&k->fading, time);

    offset += find_position(k, w, time, &k->state)
        - find_position(k, w, time, state);
    k->fading = (struct fading) { offset, time, time + longer };
    k->state = *state;
}

/* To steps at a time of the drive, with the offset that fades. */
static void
place_average(const struct kin_extruder *k, double time, struct quartic *q)
{
    const struct fading *f = &k->fading;

    q->time = time;
    q->p[0] += get_faded(f, time) - k->is.origin;
    if (time < f->end)
        q->p[1] -= f->offset / (f->end - f->start);
    for (int i = 0; i < 5; i++)
        q->p[i] *= k->is.inv_step_dist;
}

/* The steps from `time` to `end`, between which the window meets no border. */
static int
emit_window(struct kin_extruder *k, const struct window *w, double time,
            double end)
{
    const struct advance_state *state = &k->state;
    double motion = time + state->shift;
    struct quartic q, speed;
    int is_bent = state->bend.offset != 0.;

    if (is_at_rest(k->is.tq, w) && time >= k->fading.end)
        return 0;
    average_position(k, w, motion, state->half, &q);
    if (is_bent) {
        average_speed(k, w, motion, state->half, &speed);
        is_bent = !is_constant(&speed);
        if (!is_bent)
            q.p[0] += advancebend_get(&state->bend, speed.p[0]);
    }
    place_average(k, time, &q);
    if (is_bent)
        return advancebend_emit(&k->is, &state->bend, &q, &speed,
                                end - time);
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
        double until = end;
        struct advance_state state = advancelist_get_state(&k->settings, time,
                                                           &until);
        if (!advancelist_is_same(&state, &k->state))
            change_state(k, &w, time, &state);
        if (time < k->fading.end)
            until = fmin(until, k->fading.end);
        until = fmin(until, move_window(is->tq, &w, time + state.shift,
                                        state.half) - state.shift);
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
    double pre, post;

    advancelist_get_scan(&k->settings, &pre, &post);
    if (pre != is->scan_pre || post != is->scan_post)
        return -24;
    if (!isfinite(k->fading.offset) || k->fading.end < k->fading.start)
        return -23;
    return advancelist_check(&k->settings);
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
    k->settings.count = 1;
    itersolve_init(&k->is, &kind, ITERSOLVE_X);
    return k;
}
