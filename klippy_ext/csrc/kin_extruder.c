/* SPDX-License-Identifier: GPL-3.0-or-later
 * Filament drive with pressure advance.  See kin_extruder.h. */
#include <math.h>
#include <stdlib.h>

#include "kin_extruder.h"
#include "minmax.h"
#include "polyemit.h"
#include "shaperfit.h"

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

static void
get_scan(const struct kin_extruder *k, double *pre, double *post)
{
    advancelist_get_scan(&k->settings, pre, post);
    *pre += k->plan.pre;
    *post += k->plan.post;
}

static void
set_scan(struct kin_extruder *k)
{
    get_scan(k, &k->is.scan_pre, &k->is.scan_post);
}

int
kin_extruder_set_model(struct kin_extruder *k, double print_time,
                       const struct advance_model *model)
{
    int ret = advancelist_add(&k->settings, print_time, model,
                              find_needed(k));

    set_scan(k);
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

void
kin_extruder_set_shaper(struct kin_extruder *k,
                        const struct shaper_path *path,
                        const struct trapq *head)
{
    driveplan_set_shaper(&k->plan, path, head);
    set_scan(k);
}

/* ---- Positions ---- */

static double
get_faded(const struct fading *f, double time)
{
    return time < f->end ? f->offset * (f->end - time) / (f->end - f->start)
                         : 0.;
}

/* Position on a path that was started or moved to a time, `t` s later. */
static double
get_place(const struct kinkpath *p, const struct bend *bend, double t)
{
    double place = poly_get(p->q[DRIVE_PLACE], p->degree, t);

    if (bend->offset == 0.)
        return place;
    return place + advancebend_get(
        bend, poly_get(p->q[DRIVE_SPEED], p->degree, t));
}

/* Position at a time of the drive, mm. */
static double
find_position(struct kin_extruder *k, double time,
              const struct advance_state *state)
{
    struct drive_path path;

    driveplan_make_path(&path, &k->plan, state, k->is.cursor);
    kinkpath_start(&path.kinks, time + state->shift);
    return get_place(&path.kinks, &state->bend, 0.);
}

/* Positions are made in another way from `time` on: keep the one there. */
static void
change_state(struct kin_extruder *k, double time,
             const struct advance_state *state)
{
    double longer = fmax(fmax(k->state.half, state->half),
                         2. * fabs(k->state.shift - state->shift));
    double offset = get_faded(&k->fading, time);

    offset += find_position(k, time, &k->state)
        - find_position(k, time, state);
    k->fading = (struct fading) { offset, time, time + longer };
    k->state = *state;
}

/* ---- Steps ---- */

/* What emit_bent() fits: the time of t = 0, and the offset that fades. */
struct bent {
    const struct kin_extruder *k;
    double time, offset, slope;
};

static double
find_bent(void *data, double time)
{
    const struct bent *b = data;
    double t = time - b->time;

    return get_place(&b->k->path.kinks, &b->k->state.bend, t) + b->offset
        + b->slope * t;
}

static int
is_constant(const double *q, int n)
{
    for (int i = 1; i <= n; i++)
        if (q[i] != 0.)
            return 0;
    return 1;
}

/* The steps of q (mm) plus the bend of the speed. */
static int
emit_bent(struct kin_extruder *k, const double *q, double time,
          double duration)
{
    const struct kinkpath *p = &k->path.kinks;
    const double *speed = p->q[DRIVE_SPEED];
    struct quartic sum = { .time = time }, rate = { .time = time };

    if (p->degree > 4) {
        const double *plain = p->q[DRIVE_PLACE];
        struct bent b = { k, time, q[0] - plain[0], q[1] - plain[1] };
        return shaperfit_emit(&k->is, find_bent, &b, 0., time,
                              time + duration);
    }
    for (int i = 0; i < 5; i++) {
        sum.p[i] = (q[i] - (i ? 0. : k->is.origin)) * k->is.inv_step_dist;
        rate.p[i] = speed[i];
    }
    return advancebend_emit(&k->is, &k->state.bend, &sum, &rate, duration);
}

/* The steps from `time` to `end`, between which there is no event. */
static int
emit_piece(struct kin_extruder *k, double time, double end)
{
    const struct kinkpath *p = &k->path.kinks;
    const struct fading *f = &k->fading;
    const double *speed = p->q[DRIVE_SPEED];
    double q[POLY_SIZE];

    if (kinkpath_is_at_rest(p) && time >= f->end)
        return 0;
    for (int i = 0; i <= p->degree; i++)
        q[i] = p->q[DRIVE_PLACE][i];
    if (time < f->end) {
        q[0] += get_faded(f, time);
        q[1] -= f->offset / (f->end - f->start);
    }
    if (k->state.bend.offset != 0.) {
        if (!is_constant(speed, p->degree))
            return emit_bent(k, q, time, end - time);
        q[0] += advancebend_get(&k->state.bend, speed[0]);
    }
    return polyemit(&k->is, q, p->degree, time, end - time);
}

/* Have the path tell positions from `time` on.  Returns until when it is the
 * same as then (as far as settings go). */
static double
start_path(struct kin_extruder *k, double time)
{
    double until = INFINITY;
    struct advance_state state = advancelist_get_state(&k->settings, time,
                                                       &until);

    if (!advancelist_is_same(&state, &k->state))
        change_state(k, time, &state);
    driveplan_make_path(&k->path, &k->plan, &k->state, k->is.cursor);
    kinkpath_start(&k->path.kinks, time + k->state.shift);
    return until;
}

static int
emit_range(struct itersolve *is, double start, double end)
{
    struct kin_extruder *k = (struct kin_extruder *)is;
    struct kinkpath *p = &k->path.kinks;
    double time = start, same_until;
    int ret = 0;

    k->plan.tq = is->tq;
    same_until = start_path(k, time);
    while (time < end && !ret) {
        double until = min_of(min_of(end, same_until),
                              kinkpath_get_end(p) - k->state.shift);
        if (time < k->fading.end)
            until = min_of(until, k->fading.end);
        if (until <= time)      /* rounding: the borders nearly meet */
            until = fmin(nextafter(time, INFINITY), end);
        ret = emit_piece(k, time, until);
        time = until;
        if (time >= same_until)
            same_until = start_path(k, time);
        else if (time < end)
            kinkpath_move(p, time + k->state.shift);
    }
    is->cursor = p->hint;
    return ret;
}

static int
check(const struct itersolve *is)
{
    const struct kin_extruder *k = (const struct kin_extruder *)is;
    double pre, post;

    get_scan(k, &pre, &post);
    if (pre != is->scan_pre || post != is->scan_post)
        return -24;
    if (!isfinite(k->fading.offset) || k->fading.end < k->fading.start)
        return -23;
    if (driveplan_check(&k->plan))
        return driveplan_check(&k->plan);
    if (k->path.source.tq && kinkpath_check(&k->path.kinks))
        return kinkpath_check(&k->path.kinks);
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
    driveplan_init(&k->plan, &k->settings);
    itersolve_init(&k->is, &kind, ITERSOLVE_X);
    return k;
}
