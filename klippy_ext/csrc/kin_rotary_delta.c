/* SPDX-License-Identifier: GPL-3.0-or-later
 * The arms of a rotary delta.  See kin_rotary_delta.h. */
#include <stdlib.h>

#include "emitline.h"
#include "kin_rotary_delta.h"

enum { TURN_HALVINGS = 52 };

#define QUARTER 1.57079632679489661923

/* Positions and directions as the arm sees them: outwards, sideways, up, from
 * the shoulder. */
struct line {
    double p[3], r[3];
    double flat2;               /* square of the direction's length */
    double upper, lower2;
};

static double
dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void
turn_to_arm(const struct kin_rotary_delta *k, const double v[3], double out[3])
{
    out[0] = v[0] * k->cosine + v[1] * k->sine;
    out[1] = v[1] * k->cosine - v[0] * k->sine;
    out[2] = v[2];
}

/* Angle of the upper arm for a head at p.  Seen from the shoulder, the elbow
 * is outwards of the head. */
static double
solve_angle(const double p[3], double upper, double lower2)
{
    double reach = sqrt(p[0] * p[0] + p[2] * p[2]);
    double cosine = (upper * upper - lower2 + dot(p, p))
        / (2. * upper * reach + 1e-300);

    return atan2(p[0], -p[2]) - QUARTER
        + acos(fmin(fmax(cosine, -1.), 1.));
}

static double
get_position(const struct itersolve *is, const double pos[3])
{
    const struct kin_rotary_delta *k = (const struct kin_rotary_delta *)is;
    double p[3];

    turn_to_arm(k, pos, p);
    p[0] -= k->shoulder_radius;
    p[2] -= k->shoulder_height;
    return solve_angle(p, k->upper, k->lower2);
}

static void
get_place(const struct line *l, double s, double p[3])
{
    for (int i = 0; i < 3; i++)
        p[i] = l->p[i] + s * l->r[i];
}

static double
get_angle(const void *line, double s)
{
    const struct line *l = line;
    double p[3];

    get_place(l, s, p);
    return solve_angle(p, l->upper, l->lower2);
}

static double
solve_place(const void *line, double angle, int dir)
{
    const struct line *l = line;
    double from_elbow[3] = { l->p[0] - l->upper * cos(angle), l->p[1],
                             l->p[2] - l->upper * sin(angle) };
    double b = dot(from_elbow, l->r);
    double c = dot(from_elbow, from_elbow) - l->lower2;
    double root = sqrt(fmax(b * b - l->flat2 * c, 0.));

    /* the arm rises while the head comes closer to where the elbow is */
    if (dir > 0)
        return b < 0. ? c / (root - b) : -(b + root) / l->flat2;
    return b < 0. ? (root - b) / l->flat2 : -c / (b + root);
}

/* How fast the head goes away from the elbow; 0 where the arm turns. */
static double
get_parting(const struct line *l, double s)
{
    double p[3], angle;

    get_place(l, s, p);
    angle = solve_angle(p, l->upper, l->lower2);
    p[0] -= l->upper * cos(angle);
    p[2] -= l->upper * sin(angle);
    return dot(p, l->r);
}

static double
find_turn(const struct line *l, double low, double high)
{
    int is_parting = get_parting(l, low) > 0.;

    if ((get_parting(l, high) > 0.) == is_parting)
        return INFINITY;
    for (int i = 0; i < TURN_HALVINGS; i++) {
        double middle = .5 * (low + high);
        if ((get_parting(l, middle) > 0.) == is_parting)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static int
emit(struct itersolve *is, const struct trapseg *seg, double from, double to)
{
    const struct kin_rotary_delta *k = (const struct kin_rotary_delta *)is;
    struct line l = { .upper = k->upper, .lower2 = k->lower2 };

    if (trapseg_is_rest(seg))
        return 0;
    turn_to_arm(k, seg->start, l.p);
    turn_to_arm(k, seg->axes_r, l.r);
    l.p[0] -= k->shoulder_radius;
    l.p[2] -= k->shoulder_height;
    l.flat2 = dot(l.r, l.r);
    return emitline_emit(
        is, seg, &l, get_angle, solve_place,
        find_turn(&l, 0., trapseg_get_distance(seg, seg->duration)), from,
        to);
}

static int
check(const struct itersolve *is)
{
    const struct kin_rotary_delta *k = (const struct kin_rotary_delta *)is;

    if (!(k->upper > 0. && k->lower2 > 0.)
        || !isfinite(k->shoulder_radius + k->shoulder_height))
        return -60;
    return fabs(hypot(k->cosine, k->sine) - 1.) < 1e-12 ? 0 : -61;
}

static const struct itersolve_kind kind = {
    .get_position = get_position, .emit = emit,
    .check = check,
};

struct kin_rotary_delta *
kin_rotary_delta_new(double shoulder_radius, double shoulder_height,
                     double direction, double upper, double lower)
{
    struct kin_rotary_delta *k = calloc(1, sizeof(*k));

    if (!k)
        return NULL;
    k->shoulder_radius = shoulder_radius;
    k->shoulder_height = shoulder_height;
    k->cosine = cos(direction);
    k->sine = sin(direction);
    k->upper = upper;
    k->lower2 = lower * lower;
    itersolve_init(&k->is, &kind, ITERSOLVE_X | ITERSOLVE_Y | ITERSOLVE_Z);
    return k;
}
