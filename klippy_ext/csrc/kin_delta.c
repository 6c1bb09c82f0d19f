/* SPDX-License-Identifier: GPL-3.0-or-later
 * Linear delta kinematics.  See kin_delta.h. */
#include <stdlib.h>

#include "arcfit.h"
#include "emitarc.h"
#include "kin_delta.h"

/* A line of the nozzle as the tower sees it; height() below is the carriage's
 * height after `s` mm of it. */
struct line {
    double start_z, slope_z;
    double reach2;              /* arm2 less the square of the first offset */
    double toward;              /* offset along the line's direction */
    double flat2;               /* square of the direction's flat part */
};

static double
get_position(const struct itersolve *is, const double pos[3])
{
    const struct kin_delta *k = (const struct kin_delta *)is;
    double dx = k->tower_x - pos[0];
    double dy = (k->tower_y - pos[1]) * k->y_share;

    return pos[2] + sqrt(fmax(k->arm2 - dx * dx - dy * dy, 0.));
}

static void
make_line(const struct kin_delta *k, const struct trapseg *seg,
          struct line *l)
{
    double dx = k->tower_x - seg->start[0];
    double dy = (k->tower_y - seg->start[1]) * k->y_share;
    const double *r = seg->axes_r;
    double ry = r[1] * k->y_share;

    l->start_z = seg->start[2];
    l->slope_z = r[2];
    l->reach2 = k->arm2 - dx * dx - dy * dy;
    l->toward = dx * r[0] + dy * ry;
    l->flat2 = r[0] * r[0] + ry * ry;
}

static double
get_height(const void *line, double s)
{
    const struct line *l = line;
    double inside = l->reach2 + (2. * l->toward - l->flat2 * s) * s;

    return l->start_z + l->slope_z * s + sqrt(fmax(inside, 0.));
}

/* Where the height is greatest: its derivative is 0. */
static double
find_top(const struct line *l)
{
    double reach2, off;

    if (l->flat2 == 0.)
        return l->slope_z > 0. ? INFINITY : -INFINITY;
    reach2 = l->reach2 + l->toward * l->toward / l->flat2;
    off = l->slope_z * sqrt(fmax(reach2, 0.)
                            / (1. + l->slope_z * l->slope_z / l->flat2));
    return (l->toward + off) / l->flat2;
}

/* Distance at which the carriage comes to `height`, before the top (dir 1) or
 * after it (dir -1): the root that does not cancel. */
static inline double
solve_distance(const void *line, double height, int dir)
{
    const struct line *l = line;
    double up = height - l->start_z;
    double a = l->flat2 + l->slope_z * l->slope_z;
    double b = up * l->slope_z + l->toward;
    double c = up * up - l->reach2;
    double inside = b * b - a * c, way = dir * b;
    double root = sqrt(inside > 0. ? inside : 0.);
    double share = way > 0. ? c : way - root;

    return dir * share / (way > 0. ? way + root : a);
}

static int
emit(struct itersolve *is, const struct trapseg *seg, double from, double to)
{
    struct line l;

    if (trapseg_is_rest(seg))
        return 0;
    make_line((const struct kin_delta *)is, seg, &l);
    return emitline_emit(is, seg, &l, get_height, solve_distance,
                         find_top(&l), from, to);
}

/* An arc at one height: what is under the root is a projection. */
struct flat_arc {
    struct arc arc;
    double z;
};

static double
get_arc_height(const void *arc, double s)
{
    const struct flat_arc *f = arc;

    return f->z + sqrt(fmax(emitarc_get(&f->arc, s), 0.));
}

static double
solve_arc(const void *arc, double height, int dir)
{
    const struct flat_arc *f = arc;
    double up = height - f->z;

    return emitarc_solve(&f->arc, up * up, dir);
}

static int
emit_arc(struct itersolve *is, const struct trapseg *seg, double from,
         double to)
{
    const struct kin_delta *k = (const struct kin_delta *)is;
    const double *r = seg->axes_r;
    double sign = seg->turn > 0. ? 1. : -1.;
    /* From the centre to the start, and to the tower */
    double arm_x = r[1] / seg->turn, arm_y = -r[0] / seg->turn;
    double dx = k->tower_x - seg->start[0] + arm_x;
    double dy = k->tower_y - seg->start[1] + arm_y;
    struct flat_arc f = { .z = seg->start[2] };

    if (trapseg_is_rest(seg))
        return 0;
    f.arc.swing = 2. * hypot(arm_x, arm_y) * hypot(dx, dy);
    if (seg->normal != 2 || r[2] != 0. || k->y_share != 1.
        || f.arc.swing == 0.)
        return arcfit_emit(is, seg, from, to);
    f.arc.rate = fabs(seg->turn);
    f.arc.middle = k->arm2 - dx * dx - dy * dy - arm_x * arm_x
        - arm_y * arm_y;
    f.arc.top = sign * (atan2(dy, dx) - atan2(arm_y, arm_x));
    return emitarc_emit(is, seg, &f.arc, get_arc_height, solve_arc, from,
                        to);
}

static int
check(const struct itersolve *is)
{
    const struct kin_delta *k = (const struct kin_delta *)is;

    if (!(k->arm2 > 0.) || !isfinite(k->tower_x + k->tower_y))
        return -60;
    return k->y_share == 0. || k->y_share == 1. ? 0 : -61;
}

static const struct itersolve_kind kind = {
    .get_position = get_position, .emit = emit, .emit_arc = emit_arc,
    .check = check,
};

struct kin_delta *
kin_delta_new(double arm2, double tower_x, double tower_y)
{
    struct kin_delta *k = calloc(1, sizeof(*k));

    if (!k)
        return NULL;
    k->arm2 = arm2;
    k->tower_x = tower_x;
    k->tower_y = tower_y;
    k->y_share = 1.;
    itersolve_init(&k->is, &kind, ITERSOLVE_X | ITERSOLVE_Y | ITERSOLVE_Z);
    return k;
}
