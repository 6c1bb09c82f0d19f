/* SPDX-License-Identifier: GPL-3.0-or-later
 * Shaped paths.  See shaper.h. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "shaper.h"
#include "shaperfit.h"

#define SUM_ERROR 1e-9

/* ---- Settings ---- */

struct shaper_path *
shaper_path_new(void)
{
    struct shaper_path *path = calloc(1, sizeof(*path));
    const struct shaper_axis plain = {
        .n_impulses = 1, .weights = { 1. },
    };

    if (!path)
        return NULL;
    path->barrier = -INFINITY;
    for (int axis = 0; axis < 3; axis++)
        shaper_path_set_axis(path, axis, &plain);
    return path;
}

void
shaper_path_delete(struct shaper_path *path)
{
    free(path);
}

/* 0 if what is set is a mean: the sum of weights is 1. */
static int
check_axis(const struct shaper_axis *shaper)
{
    double sum = 0.;

    if (shaper->n_impulses < 0 || shaper->n_impulses > SHAPER_IMPULSES_MAX
        || shaper->n_coeffs < 0 || shaper->n_coeffs > SHAPER_COEFFS_MAX
        || !shaper->n_impulses == !shaper->n_coeffs)
        return -EINVAL;
    for (int i = 0; i < shaper->n_impulses; i++) {
        sum += shaper->weights[i];
        if (!isfinite(shaper->delays[i]))
            return -EINVAL;
    }
    for (int i = 0; i < shaper->n_coeffs; i += 2)
        sum += 2. * shaper->coeffs[i] / (i + 1);
    if (shaper->n_coeffs && !(shaper->half > 0. && isfinite(shaper->half)))
        return -EINVAL;
    return fabs(sum - 1.) < SUM_ERROR ? 0 : -EINVAL;
}

/* The tap at a delay; made if there is none. */
static struct shaper_tap *
find_tap(struct shaper_path *path, double delay)
{
    struct shaper_tap *tap;

    for (int i = 0; i < path->n_taps; i++)
        if (path->taps[i].delay == delay)
            return &path->taps[i];
    tap = &path->taps[path->n_taps++];
    memset(tap, 0, sizeof(*tap));
    tap->delay = delay;
    return tap;
}

static void
set_taps(struct shaper_path *path)
{
    path->n_taps = 0;
    path->kernel_axes = 0;
    path->pre = path->post = 0.;
    for (int axis = 0; axis < 3; axis++) {
        const struct shaper_axis *a = &path->axes[axis];
        for (int i = 0; i < a->n_impulses; i++)
            find_tap(path, a->delays[i])->weight[axis] = a->weights[i];
        if (!a->n_coeffs)
            continue;
        path->kernel_axes |= 1u << axis;
        find_tap(path, a->half);
        find_tap(path, -a->half);
    }
    for (int i = 0; i < path->n_taps; i++) {
        path->pre = fmax(path->pre, path->taps[i].delay);
        path->post = fmax(path->post, -path->taps[i].delay);
    }
}

int
shaper_path_set_axis(struct shaper_path *path, int axis,
                     const struct shaper_axis *shaper)
{
    int ret = check_axis(shaper);

    if (ret)
        return ret;
    path->axes[axis] = *shaper;
    memset(path->moments[axis], 0, sizeof(path->moments[axis]));
    for (int k = 0; k < 3; k++)         /* integrals of w(u) * u^k */
        for (int i = 0; i < shaper->n_coeffs; i++)
            path->moments[axis][k][i + k + 1] = shaper->coeffs[i]
                / (i + k + 1);
    set_taps(path);
    return 0;
}

void
shaper_attach(struct itersolve *is, struct shaper_path *path)
{
    is->path = path;
    is->scan_pre = path ? path->pre : 0.;
    is->scan_post = path ? path->post : 0.;
    shaper_forget(is);
}

void
shaper_forget(struct itersolve *is)
{
    if (is->path)
        is->path->barrier = fmax(is->done_time,
                                 is->tq ? is->tq->end_time : 0.);
}

/* ---- The plan at a tap ---- */

static void
set_rest(struct shaper_tap *tap, const struct trapseg *seg, double t)
{
    double way = trapseg_get_distance(seg, t);

    for (int i = 0; i < 3; i++) {
        tap->p[i] = seg->start[i] + seg->axes_r[i] * way;
        tap->v[i] = tap->h[i] = 0.;
    }
}

static void
set_motion(struct shaper_tap *tap, const struct trapseg *seg)
{
    for (int i = 0; i < 3; i++) {
        tap->p[i] = seg->start[i];
        tap->v[i] = seg->axes_r[i] * seg->start_v;
        tap->h[i] = seg->axes_r[i] * seg->half_accel;
    }
}

/* Have the tap hold what is planned for a time of the path. */
static void
move_tap(struct shaper_tap *tap, const struct trapq *tq, double barrier,
         double time)
{
    double planned = fmax(time - tap->delay, barrier);
    uint64_t i = trapq_find(tq, tap->cursor, planned);
    const struct trapseg *seg = trapq_get(tq, i < tq->end ? i : tq->end - 1);
    int is_after = i >= tq->end, is_before = planned < seg->time;

    tap->cursor = i;
    if (is_after || is_before) {
        set_rest(tap, seg, is_after ? seg->duration : 0.);
        tap->begin = (is_after ? trapseg_get_end(seg) : -INFINITY)
            + tap->delay;
        tap->end = (is_after ? INFINITY : seg->time) + tap->delay;
    } else {
        set_motion(tap, seg);
        tap->begin = seg->time + tap->delay;
        tap->end = trapseg_get_end(seg) + tap->delay;
    }
    if (time - tap->delay < barrier) {
        set_rest(tap, seg, fmin(fmax(barrier - seg->time, 0.),
                                seg->duration));
        tap->begin = -INFINITY;
        tap->end = barrier + tap->delay;
    }
}

/* Move the taps whose piece is over.  Returns when the next one is. */
static double
move_taps(struct shaper_path *path, const struct trapq *tq, double time)
{
    double end = INFINITY;

    for (int i = 0; i < path->n_taps; i++) {
        struct shaper_tap *tap = &path->taps[i];
        if (tap->end <= time)
            move_tap(tap, tq, path->barrier, time);
        end = fmin(end, tap->end);
    }
    return end;
}

static void
forget_taps(struct shaper_path *path)
{
    for (int i = 0; i < path->n_taps; i++)
        path->taps[i].end = -INFINITY;
}

/* ---- Positions ---- */

/* Integrals of w(u) * u^k, k = 0, 1, 2, up to u; from a constant on. */
static void
get_moments(const struct shaper_path *path, int axis, double u, double m[3])
{
    const double (*c)[SHAPER_COEFFS_MAX + 3] = path->moments[axis];

    m[0] = m[1] = m[2] = 0.;
    for (int i = path->axes[axis].n_coeffs + 2; i >= 0; i--)
        for (int k = 0; k < 3; k++)
            m[k] = m[k] * u + c[k][i];
}

/* What `tap` holds is p + (v + h * t) * t, t = time - begin - u * half; by
 * power of u, for an axis. */
static void
expand_piece(const struct shaper_path *path, int axis,
             const struct shaper_tap *tap, double time, double c[3])
{
    double half = path->axes[axis].half;
    double t = isinf(tap->begin) ? 0. : time - tap->begin;

    c[0] = tap->p[axis] + (tap->v[axis] + tap->h[axis] * t) * t;
    c[1] = -(tap->v[axis] + 2. * tap->h[axis] * t) * half;
    c[2] = tap->h[axis] * half * half;
}

/* The plan averaged by the kernel of an axis. */
static double
average(const struct shaper_path *path, const struct trapq *tq, int axis,
        double time, uint64_t *cursor)
{
    double half = path->axes[axis].half, high = 1., sum = 0.;
    double before[3], after[3], c[3];
    struct shaper_tap piece = { .cursor = *cursor };

    get_moments(path, axis, high, after);
    while (high > -1.) {                /* from the oldest on */
        double low;
        move_tap(&piece, tq, path->barrier, time - high * half);
        if (high == 1.)
            *cursor = piece.cursor;
        low = fmax((time - piece.end) / half, -1.);
        if (!(low < high))
            low = fmax(nextafter(high, -2.), -1.);
        get_moments(path, axis, low, before);
        expand_piece(path, axis, &piece, time, c);
        for (int k = 0; k < 3; k++) {
            sum += c[k] * (after[k] - before[k]);
            after[k] = before[k];
        }
        high = low;
    }
    return sum;
}

/* After move_taps(). */
static void
get_place(struct shaper_path *path, const struct trapq *tq, uint32_t axes,
          double time, double pos[3])
{
    uint64_t cursor = path->taps[0].cursor;

    for (int axis = 0; axis < 3; axis++)
        pos[axis] = (axes & path->kernel_axes & (1u << axis))
            ? average(path, tq, axis, time, &cursor) : 0.;
    for (int i = 0; i < path->n_taps; i++) {
        const struct shaper_tap *tap = &path->taps[i];
        double t = isinf(tap->begin) ? 0. : time - tap->begin;
        for (int axis = 0; axis < 3; axis++)
            if (tap->weight[axis] != 0.)
                pos[axis] += tap->weight[axis] * (
                    tap->p[axis]
                    + (tap->v[axis] + tap->h[axis] * t) * t);
    }
}

int
shaper_get_position(struct shaper_path *path, const struct trapq *tq,
                    double time, double pos[3])
{
    if (trapq_is_empty(tq))
        return -EINVAL;
    forget_taps(path);
    move_taps(path, tq, time);
    get_place(path, tq, path->kernel_axes, time, pos);
    return 0;
}

/* ---- Steps ---- */

/* Nothing moves on the axes of this stepper. */
static int
is_at_rest(const struct itersolve *is, const struct shaper_path *path)
{
    uint64_t cursor = path->taps[0].cursor;
    int has_kernel = (path->kernel_axes & is->active_axes) != 0;

    for (int i = 0; i < path->n_taps; i++) {
        const struct shaper_tap *tap = &path->taps[i];
        for (int axis = 0; axis < 3; axis++)
            if ((is->active_axes & (1u << axis))
                && (tap->weight[axis] != 0. || has_kernel)
                && (tap->v[axis] != 0. || tap->h[axis] != 0.))
                return 0;
        if (has_kernel && tap->cursor != cursor)
            return 0;
    }
    return 1;
}

/* Add factor * (p + (v + h * t) * t) of an axis of a tap, t from `base`. */
static void
add_tap(struct quadratic *q, const struct shaper_tap *tap, int axis,
        double factor, double base)
{
    double t = isinf(tap->begin) ? 0. : base - tap->begin;
    double v = tap->v[axis], h = tap->h[axis];

    q->p0 += factor * (tap->p[axis] + (v + h * t) * t);
    q->p1 += factor * (v + 2. * h * t);
    q->p2 += factor * h;
}

static const struct shaper_tap *
get_edge(const struct shaper_path *path, double delay)
{
    const struct shaper_tap *tap = path->taps;

    while (tap->delay != delay)
        tap++;
    return tap;
}

/* Is all that the kernel of an axis sees one segment? */
static int
is_whole(const struct shaper_path *path, int axis)
{
    double half = path->axes[axis].half;
    const struct shaper_tap *a = get_edge(path, half);
    const struct shaper_tap *b = get_edge(path, -half);

    return a->cursor == b->cursor && isfinite(a->begin)
        && isfinite(b->begin);
}

/* A kernel over one segment: the mean of a polynomial of degree two. */
static void
add_kernel(struct quadratic *q, const struct shaper_path *path, int axis,
           double factor, double base)
{
    double half = path->axes[axis].half, low[3], high[3];
    struct shaper_tap tap = *get_edge(path, half);
    double m1, m2, v, h = tap.h[axis];

    get_moments(path, axis, -1., low);
    get_moments(path, axis, 1., high);
    m1 = half * (high[1] - low[1]);
    m2 = half * half * (high[2] - low[2]);
    tap.begin -= half;
    v = tap.v[axis] + 2. * h * (base - tap.begin);
    add_tap(q, &tap, axis, factor, base);
    q->p0 += factor * (h * m2 - v * m1);
    q->p1 -= factor * 2. * h * m1;
}

/* Can the path of this stepper be told by a polynomial of degree two? */
static int
is_quadratic(const struct itersolve *is)
{
    uint32_t axes = is->path->kernel_axes & is->active_axes;

    if (!is->kind->get_weights)
        return 0;
    for (int axis = 0; axis < 3; axis++)
        if ((axes & (1u << axis)) && !is_whole(is->path, axis))
            return 0;
    return 1;
}

/* The steps of linear kinematics between two times without a border. */
static int
emit_linear(struct itersolve *is, double time, double until)
{
    const struct shaper_path *path = is->path;
    double base = -INFINITY, weights[3], offset;
    struct quadratic q = { .time = time };

    is->kind->get_weights(is, weights, &offset);
    for (int i = 0; i < path->n_taps; i++)
        base = fmax(base, path->taps[i].begin);
    q.time = base = isinf(base) ? time : base;
    for (int axis = 0; axis < 3; axis++) {
        if (weights[axis] == 0.)
            continue;
        if (path->kernel_axes & (1u << axis))
            add_kernel(&q, path, axis, weights[axis], base);
        for (int i = 0; i < path->n_taps; i++)
            if (path->taps[i].weight[axis] != 0.)
                add_tap(&q, &path->taps[i], axis,
                        weights[axis] * path->taps[i].weight[axis], base);
    }
    q.p0 = itersolve_to_steps(is, q.p0 + offset);
    q.p1 *= is->inv_step_dist;
    q.p2 *= is->inv_step_dist;
    return itersolve_emit_quadratic(is, &q, time - base, until - base);
}

static double
find_place(void *data, double time)
{
    struct itersolve *is = data;
    double pos[3];

    get_place(is->path, is->tq, is->active_axes, time, pos);
    return is->kind->get_position(is, pos);
}

static int
emit_piece(struct itersolve *is, double time, double until)
{
    if (is_at_rest(is, is->path))
        return 0;
    if (is_quadratic(is))
        return emit_linear(is, time, until);
    return shaperfit_emit(is, find_place, is, is->kind->period, time, until);
}

int
shaper_emit(struct itersolve *is, double start, double end)
{
    struct shaper_path *path = is->path;
    double time = start;
    int ret = 0;

    forget_taps(path);
    while (time < end && !ret) {
        double until = fmin(move_taps(path, is->tq, time), end);
        if (until <= time)      /* rounding: the borders nearly meet */
            until = fmin(nextafter(time, INFINITY), end);
        ret = emit_piece(is, time, until);
        time = until;
    }
    return ret;
}

int
shaper_path_check(const struct shaper_path *path)
{
    double pre = 0., post = 0.;

    if (path->n_taps < 1 || path->n_taps > SHAPER_TAPS_MAX)
        return -40;
    for (int axis = 0; axis < 3; axis++)
        if (check_axis(&path->axes[axis]))
            return -41;
    for (int i = 0; i < path->n_taps; i++) {
        pre = fmax(pre, path->taps[i].delay);
        post = fmax(post, -path->taps[i].delay);
    }
    return pre == path->pre && post == path->post ? 0 : -42;
}
