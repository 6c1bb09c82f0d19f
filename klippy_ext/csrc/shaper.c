/* SPDX-License-Identifier: GPL-3.0-or-later
 * Shaped paths.  See shaper.h. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "minmax.h"
#include "polyemit.h"
#include "shaper.h"
#include "shapercore.h"
#include "shaperfit.h"

/* What is left out of the path of an axis, mm: far less than SHAPER_ERROR. */
#define CUT_ERROR 1e-10

/* ---- Settings ---- */

struct shaper_path *
shaper_path_new(void)
{
    struct shaper_path *path = calloc(1, sizeof(*path));
    const struct shaper_axis plain = { .n_impulses = 0 };

    if (!path)
        return NULL;
    path->barrier = -INFINITY;
    for (int axis = 0; axis < 3; axis++)
        reply_make(&path->replies[axis], &plain, 0.);
    return path;
}

void
shaper_path_delete(struct shaper_path *path)
{
    free(path);
}

int
shaper_path_set_axis(struct shaper_path *path, int axis,
                     const struct shaper_axis *shaper)
{
    int ret = shaper_axis_check(shaper);

    if (ret)
        return ret;
    path->axes[axis] = *shaper;
    reply_make(&path->replies[axis], shaper, 0.);
    path->pre = path->post = 0.;
    for (int i = 0; i < 3; i++) {
        path->pre = fmax(path->pre, reply_get_pre(&path->replies[i]));
        path->post = fmax(path->post, reply_get_post(&path->replies[i]));
    }
    return 0;
}

static int
is_equal(const double *a, const double *b, int n)
{
    return !memcmp(a, b, (size_t)n * sizeof(*a));
}

int
shaper_path_is_same(const struct shaper_path *path, int a, int b)
{
    const struct shaper_axis *p = &path->axes[a], *q = &path->axes[b];

    return p->n_impulses == q->n_impulses && p->n_coeffs == q->n_coeffs
        && (!p->n_coeffs || p->half == q->half)
        && is_equal(p->weights, q->weights, p->n_impulses)
        && is_equal(p->delays, q->delays, p->n_impulses)
        && is_equal(p->coeffs, q->coeffs, p->n_coeffs);
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

/* ---- The plan ---- */

static double
weigh(const double weights[3], const double v[3])
{
    return weights[0] * v[0] + weights[1] * v[1] + weights[2] * v[2];
}

/* How many powers count. */
static int
get_motion(const double weights[3], const struct trapseg *seg,
           double piece[KINK_SIZE])
{
    double ratio;

    if (seg->turn != 0. && !trapseg_is_rest(seg) && seg->duration > 0.) {
        trapseg_fit(seg, weights, piece);
        return KINK_SIZE;
    }
    ratio = weigh(weights, seg->axes_r);
    piece[0] = weigh(weights, seg->start);
    piece[1] = ratio * seg->start_v;
    piece[2] = ratio * seg->half_accel;
    return 3;
}

/* `t` s later. */
static void
follow(double piece[KINK_SIZE], int n, double t)
{
    if (n > 3) {
        poly_shift(piece, n - 1, t);
        return;
    }
    piece[0] += (piece[1] + piece[2] * t) * t;
    piece[1] += 2. * piece[2] * t;
}

static int
get_piece(const struct kink_source *source, int channel, uint64_t number,
          int is_rest, double piece[KINK_SIZE])
{
    const struct shaper_path *path = source->data;
    const struct trapq *tq = source->tq;
    int is_after = number >= tq->end;
    const struct trapseg *seg = trapq_get(tq, is_after ? tq->end - 1
                                                       : number);
    int n = get_motion(path->weights[channel], seg, piece);

    if (is_after)
        follow(piece, n, seg->duration);
    if (!is_after && !is_rest)
        return n;
    piece[1] = piece[2] = 0.;
    return 3;
}

/* Between two segments that are straight. */
static int
get_plain_jump(const double weights[3], const struct trapseg *a,
               const struct trapseg *b, double jump[KINK_SIZE])
{
    double from = weigh(weights, a->axes_r), to = weigh(weights, b->axes_r);
    double t = a->duration, h = from * a->half_accel, v = from * a->start_v;

    jump[0] = weigh(weights, b->start)
        - (weigh(weights, a->start) + (v + h * t) * t);
    jump[1] = to * b->start_v - (v + 2. * h * t);
    jump[2] = to * b->half_accel - h;
    return 3;
}

static int
get_jump(const struct kink_source *source, int channel, uint64_t number,
         int is_first, double jump[KINK_SIZE])
{
    const struct trapq *tq = source->tq;
    const struct shaper_path *path = source->data;
    double before[KINK_SIZE];
    int n, n_before;

    if (!is_first && number < tq->end
        && trapq_get(tq, number)->turn == 0.
        && trapq_get(tq, number - 1)->turn == 0.)
        return get_plain_jump(path->weights[channel],
                              trapq_get(tq, number - 1),
                              trapq_get(tq, number), jump);
    n = get_piece(source, channel, number, 0, jump);

    if (is_first) {
        jump[0] = 0.;
        return n;
    }
    n_before = get_piece(source, channel, number - 1, 0, before);
    follow(before, n_before,
           trapq_get(source->tq, number - 1)->duration);
    for (; n < n_before; n++)
        jump[n] = 0.;
    for (int i = 0; i < n_before; i++)
        jump[i] -= before[i];
    return n;
}

/* Add an axis to the first channel that is averaged alike. */
static void
join_axis(struct shaper_path *path, int axis, double weight)
{
    struct kinkpath *k = &path->kinks;

    for (int i = 0; i < axis; i++)
        for (int line = 0; line < k->n_lines; line++)
            if (k->lines[line].reply == &path->replies[i]
                && shaper_path_is_same(path, i, axis)) {
                path->weights[line][axis] = weight;
                return;
            }
    path->weights[k->n_lines][axis] = weight;
    kinkpath_add(k, k->n_lines, 0, &path->replies[axis]);
}

/* One polynomial for all axes, or one for each. */
static void
set_channels(struct shaper_path *path, const struct trapq *tq,
             const double weights[3], uint32_t axes)
{
    path->source = (struct kink_source) { tq, path, get_piece, get_jump };
    memset(path->weights, 0, sizeof(path->weights));
    kinkpath_init(&path->kinks, &path->source, weights ? 1 : 3,
                  path->barrier, path->kinks.hint);
    for (int axis = 0; axis < 3; axis++) {
        if (weights && weights[axis] != 0.)
            join_axis(path, axis, weights[axis]);
        if (weights || !(axes & (1u << axis)))
            continue;
        path->weights[axis][axis] = 1.;
        kinkpath_add(&path->kinks, axis, axis, &path->replies[axis]);
    }
}

int
shaper_get_position(struct shaper_path *path, const struct trapq *tq,
                    double time, double pos[3])
{
    if (trapq_is_empty(tq))
        return -EINVAL;
    set_channels(path, tq, NULL, 7);
    kinkpath_start(&path->kinks, time);
    for (int axis = 0; axis < 3; axis++)
        pos[axis] = path->kinks.q[axis][0];
    return 0;
}

/* ---- Steps ---- */

static double
find_place(void *data, double time)
{
    const struct itersolve *is = data;
    const struct shaper_path *path = is->path;
    double t = time - path->kinks.time, pos[3];

    for (int axis = 0; axis < 3; axis++)
        pos[axis] = poly_get(path->kinks.q[axis], path->degrees[axis], t);
    return is->kind->get_position(is, pos);
}

/* Powers of the path that matter for so long. */
static void
find_degrees(struct shaper_path *path, double duration)
{
    for (int axis = 0; axis < 3; axis++)
        path->degrees[axis] = poly_cut(path->kinks.q[axis],
                                       path->kinks.degree, duration,
                                       CUT_ERROR);
}

/* The steps between two times without an event. */
static int
emit_piece(struct itersolve *is, double time, double until, double offset)
{
    const struct kinkpath *k = &is->path->kinks;
    double q[POLY_SIZE];

    if (k->n_polys == 1 && offset == 0.)
        return polyemit(is, k->q[0], k->degree, time, until - time);
    if (kinkpath_is_at_rest(k))
        return 0;
    if (k->n_polys > 1)
        find_degrees(is->path, until - time);
    if (is->kind->core > 0.)
        return shapercore_emit(is, find_place, is, time, until);
    if (k->n_polys > 1)
        return shaperfit_emit(is, find_place, is, is->kind->period, time,
                              until);
    for (int i = 0; i <= k->degree; i++)
        q[i] = k->q[0][i];
    q[0] += offset;
    return polyemit(is, q, k->degree, time, until - time);
}

int
shaper_emit(struct itersolve *is, double start, double end)
{
    struct kinkpath *k = &is->path->kinks;
    int is_linear = is->kind->get_weights != NULL, ret = 0;
    double time = start, weights[3], offset = 0.;

    if (is_linear)
        is->kind->get_weights(is, weights, &offset);
    set_channels(is->path, is->tq, is_linear ? weights : NULL,
                 is->active_axes);
    kinkpath_start(k, time);
    while (time < end && !ret) {
        double until = min_of(kinkpath_get_end(k), end);
        ret = emit_piece(is, time, until, offset);
        time = until;
        if (time < end)
            kinkpath_move(k, time);
    }
    return ret;
}

int
shaper_path_check(const struct shaper_path *path)
{
    double pre = 0., post = 0.;

    for (int axis = 0; axis < 3; axis++) {
        const struct reply *r = &path->replies[axis];
        if (shaper_axis_check(&path->axes[axis]))
            return -41;
        if (reply_check(r))
            return reply_check(r);
        pre = fmax(pre, reply_get_pre(r));
        post = fmax(post, reply_get_post(r));
    }
    if (pre != path->pre || post != path->post)
        return -42;
    return path->source.tq ? kinkpath_check(&path->kinks) : 0;
}
