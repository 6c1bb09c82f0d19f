/* SPDX-License-Identifier: GPL-3.0-or-later
 * Linear kinematics.  See kin_linear.h. */
#include <stdlib.h>
#include <string.h>

#include "arcfit.h"
#include "emitarc.h"
#include "kin_linear.h"
#include "shaper.h"

static double
get_sum(const struct itersolve *is, const double v[3])
{
    const double *c = ((const struct kin_linear *)is)->coeffs;

    return c[0] * v[0] + c[1] * v[1] + c[2] * v[2];
}

static double
get_position(const struct itersolve *is, const double pos[3])
{
    return get_sum(is, pos) + ((const struct kin_linear *)is)->offset;
}

static int
emit(struct itersolve *is, const struct trapseg *seg, double from, double to)
{
    double ratio = get_sum(is, seg->axes_r) * is->inv_step_dist;
    struct quadratic q = {
        .time = seg->time,
        .p0 = itersolve_to_steps(is, get_position(is, seg->start)),
        .p1 = ratio * seg->start_v, .p2 = ratio * seg->half_accel,
    };

    if (ratio == 0.)
        return 0;
    return itersolve_emit_quadratic(is, &q, from, to);
}

static double
get_projection(const void *arc, double s)
{
    return emitarc_get(arc, s);
}

static double
solve_projection(const void *arc, double position, int dir)
{
    return emitarc_solve(arc, position, dir);
}

/* A stepper that sees the arc from its plane moves as cosine. */
static int
emit_arc(struct itersolve *is, const struct trapseg *seg, double from,
         double to)
{
    const double *c = ((const struct kin_linear *)is)->coeffs;
    const double *r = seg->axes_r;
    uint32_t n = seg->normal, a = (n + 1) % 3, b = (n + 2) % 3;
    double along = (c[a] * r[a] + c[b] * r[b]) / fabs(seg->turn);
    double aside = (c[b] * r[a] - c[a] * r[b]) / seg->turn;
    struct arc arc = {
        .rate = fabs(seg->turn), .swing = hypot(along, aside),
        .middle = get_position(is, seg->start) + aside,
        .top = atan2(along, -aside),
    };

    if (c[a] == 0. && c[b] == 0.)
        return emit(is, seg, from, to);
    if (c[n] * r[n] != 0.)
        return arcfit_emit(is, seg, from, to);
    if (trapseg_is_rest(seg) || arc.swing == 0.)
        return 0;
    return emitarc_emit(is, seg, &arc, get_projection, solve_projection,
                        from, to);
}

static void
get_weights(const struct itersolve *is, double weights[3], double *offset)
{
    const struct kin_linear *k = (const struct kin_linear *)is;

    memcpy(weights, k->coeffs, sizeof(k->coeffs));
    *offset = k->offset;
}

static int
check(const struct itersolve *is)
{
    const struct kin_linear *k = (const struct kin_linear *)is;

    for (int i = 0; i < 3; i++)
        if (!isfinite(k->coeffs[i])
            || (k->coeffs[i] != 0.) != (is->active_axes >> i & 1u))
            return -60;
    return isfinite(k->offset) ? 0 : -61;
}

static const struct itersolve_kind kind = {
    .get_position = get_position, .emit = emit, .emit_arc = emit_arc,
    .get_weights = get_weights,
    .check = check,
};

void
kin_linear_set(struct kin_linear *k, double cx, double cy, double cz,
               double offset)
{
    k->coeffs[0] = cx;
    k->coeffs[1] = cy;
    k->coeffs[2] = cz;
    k->offset = offset;
    shaper_forget(&k->is);
    k->is.active_axes = (cx != 0. ? ITERSOLVE_X : 0u)
        | (cy != 0. ? ITERSOLVE_Y : 0u) | (cz != 0. ? ITERSOLVE_Z : 0u);
}

struct kin_linear *
kin_linear_new(double cx, double cy, double cz)
{
    struct kin_linear *k = calloc(1, sizeof(*k));

    if (!k)
        return NULL;
    itersolve_init(&k->is, &kind, 0);
    kin_linear_set(k, cx, cy, cz, 0.);
    return k;
}
