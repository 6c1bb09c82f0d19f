/* SPDX-License-Identifier: GPL-3.0-or-later
 * Linear delta kinematics.  See kin_delta.h. */
#include <math.h>
#include <stdlib.h>

#include "kin_delta.h"

enum { BATCH = 64 };

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
    double dx = k->tower_x - pos[0], dy = k->tower_y - pos[1];

    return pos[2] + sqrt(fmax(k->arm2 - dx * dx - dy * dy, 0.));
}

static void
make_line(const struct kin_delta *k, const struct trapseg *seg,
          struct line *l)
{
    double dx = k->tower_x - seg->start[0], dy = k->tower_y - seg->start[1];
    const double *r = seg->axes_r;

    l->start_z = seg->start[2];
    l->slope_z = r[2];
    l->reach2 = k->arm2 - dx * dx - dy * dy;
    l->toward = dx * r[0] + dy * r[1];
    l->flat2 = r[0] * r[0] + r[1] * r[1];
}

static double
get_height(const struct line *l, double s)
{
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
 * after it (dir -1). */
static double
solve_distance(const struct line *l, double height, int dir)
{
    double up = height - l->start_z;
    double a = l->flat2 + l->slope_z * l->slope_z;
    double b = up * l->slope_z + l->toward;
    double c = up * up - l->reach2;
    double root = sqrt(fmax(b * b - a * c, 0.));

    if (dir > 0)
        return b > 0. ? c / (b + root) : (b - root) / a;
    return b < 0. ? c / (b - root) : (b + root) / a;
}

static double
solve_time(const struct trapseg *seg, double distance)
{
    double inside = seg->start_v * seg->start_v
        + 4. * seg->half_accel * distance;

    return 2. * distance / (seg->start_v + sqrt(fmax(inside, 0.)) + 1e-300);
}

/* Steps between two times; the carriage keeps its direction. */
static int
emit_monotone(struct itersolve *is, const struct trapseg *seg,
              const struct line *l, double from, double to)
{
    double begin = itersolve_to_steps(
        is, get_height(l, trapseg_get_distance(seg, from)));
    double end = itersolve_to_steps(
        is, get_height(l, trapseg_get_distance(seg, to)));
    int dir = end >= begin ? 1 : -1;
    int ret = itersolve_align(is, seg->time + from, begin);
    int64_t count = itersolve_count_to(is, end, dir);

    while (count > 0 && !ret) {
        double times[BATCH];
        int n = count < BATCH ? (int)count : BATCH;
        for (int i = 0; i < n; i++) {
            double level = itersolve_get_level(is, i, dir);
            double height = is->origin + level * is->step_dist;
            double t = solve_time(seg, solve_distance(l, height, dir));
            times[i] = seg->time + fmin(fmax(t, from), to);
        }
        count -= n;
        ret = itersolve_push(is, times, n, dir);
    }
    return ret;
}

static int
emit(struct itersolve *is, const struct trapseg *seg, double from, double to)
{
    struct line l;
    double top, top_time = to;
    int ret;

    if (trapseg_is_rest(seg))
        return 0;
    make_line((const struct kin_delta *)is, seg, &l);
    top = find_top(&l);
    if (top > trapseg_get_distance(seg, from)
        && top < trapseg_get_distance(seg, to))
        top_time = fmin(fmax(solve_time(seg, top), from), to);
    ret = emit_monotone(is, seg, &l, from, top_time);
    if (ret || top_time >= to)
        return ret;
    return emit_monotone(is, seg, &l, top_time, to);
}

static const struct itersolve_kind kind = {
    .get_position = get_position, .emit = emit,
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
    itersolve_init(&k->is, &kind, ITERSOLVE_X | ITERSOLVE_Y | ITERSOLVE_Z);
    return k;
}
