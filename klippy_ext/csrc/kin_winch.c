/* SPDX-License-Identifier: GPL-3.0-or-later
 * Distances from a point.  See kin_winch.h. */
#include <stdlib.h>

#include "emitline.h"
#include "kin_winch.h"

/* The square of the distance after s mm is start2 + (2 * along + flat2 * s)
 * * s. */
struct line {
    double start, start2;
    double along;
    double flat2;               /* square of the direction's part that counts */
};

static double
get_position(const struct itersolve *is, const double pos[3])
{
    const struct kin_winch *k = (const struct kin_winch *)is;
    double dx = pos[0] - k->anchor[0], dy = pos[1] - k->anchor[1];
    double dz = (pos[2] - k->anchor[2]) * k->z_share;

    return sqrt(dx * dx + dy * dy + dz * dz);
}

static double
get_length(const void *line, double s)
{
    const struct line *l = line;

    return sqrt(fmax(l->start2 + (2. * l->along + l->flat2 * s) * s, 0.));
}

/* The distance falls up to the closest place (dir -1) and rises after it. */
static double
solve_place(const void *line, double length, int dir)
{
    const struct line *l = line;
    double c = (l->start - length) * (l->start + length), b = l->along;
    double root = sqrt(fmax(b * b - l->flat2 * c, 0.));

    if (dir < 0)
        return b < 0. ? c / (root - b) : -(b + root) / l->flat2;
    return b < 0. ? (root - b) / l->flat2 : -c / (b + root);
}

static int
emit(struct itersolve *is, const struct trapseg *seg, double from, double to)
{
    const struct kin_winch *k = (const struct kin_winch *)is;
    double dx = seg->start[0] - k->anchor[0];
    double dy = seg->start[1] - k->anchor[1];
    double dz = (seg->start[2] - k->anchor[2]) * k->z_share;
    const double *r = seg->axes_r;
    double rz = r[2] * k->z_share;
    struct line l = {
        .start2 = dx * dx + dy * dy + dz * dz,
        .along = dx * r[0] + dy * r[1] + dz * rz,
        .flat2 = r[0] * r[0] + r[1] * r[1] + rz * rz,
    };

    if (trapseg_is_rest(seg))
        return 0;
    l.start = sqrt(l.start2);
    return emitline_emit(is, seg, &l, get_length, solve_place,
                         -l.along / l.flat2, from, to);
}

static int
check(const struct itersolve *is)
{
    const struct kin_winch *k = (const struct kin_winch *)is;

    if (!isfinite(k->anchor[0] + k->anchor[1] + k->anchor[2]))
        return -60;
    return k->z_share == 0. || k->z_share == 1. ? 0 : -61;
}

static const struct itersolve_kind kind = {
    .get_position = get_position, .emit = emit,
    .check = check,
};

static struct kin_winch *
make(double z_share, uint32_t axes)
{
    struct kin_winch *k = calloc(1, sizeof(*k));

    if (!k)
        return NULL;
    k->z_share = z_share;
    itersolve_init(&k->is, &kind, axes);
    return k;
}

struct kin_winch *
kin_winch_new(double x, double y, double z)
{
    struct kin_winch *k = make(1., ITERSOLVE_X | ITERSOLVE_Y | ITERSOLVE_Z);

    if (!k)
        return NULL;
    k->anchor[0] = x;
    k->anchor[1] = y;
    k->anchor[2] = z;
    return k;
}

struct kin_winch *
kin_winch_new_radius(void)
{
    return make(0., ITERSOLVE_X | ITERSOLVE_Y);
}
