/* SPDX-License-Identifier: GPL-3.0-or-later
 * The bed of a polar machine.  See kin_polar.h. */
#include <stdlib.h>

#include "emitline.h"
#include "kin_polar.h"

#define TURN (2. * 3.14159265358979323846)

/* A line that does not come near the centre, from `origin` mm on. */
struct line {
    double origin, angle;       /* there, counted over turns */
    double dist2, along, across;
};

/* The flat part of a segment's line, and where it is in the core. */
struct course {
    double x, y, rx, ry;
    double enter, foot, leave;  /* mm; leave is 0 if it never is */
};

static double
get_position(const struct itersolve *is, const double pos[3])
{
    (void)is;
    return atan2(pos[1], pos[0]);
}

/* The angle of a place, of the turn in which the bed is. */
static double
find_angle(const struct itersolve *is, double x, double y)
{
    double angle = atan2(y, x);
    double away = itersolve_get_commanded_pos(is) - angle;

    return angle + TURN * floor(away / TURN + .5);
}

static double
get_angle(const void *line, double s)
{
    const struct line *l = line;
    double way = s - l->origin;

    return l->angle + atan2(way * l->across, l->dist2 + way * l->along);
}

/* The cut of the line with the ray of that angle. */
static double
solve_place(const void *line, double angle, int dir)
{
    const struct line *l = line;
    double sine = sin(angle - l->angle), cosine = cos(angle - l->angle);

    (void)dir;
    return l->origin
        + l->dist2 * sine / (l->across * cosine - l->along * sine);
}

static void
make_course(const struct trapseg *seg, struct course *c)
{
    double flat2, along, across, half;

    c->x = seg->start[0];
    c->y = seg->start[1];
    c->rx = seg->axes_r[0];
    c->ry = seg->axes_r[1];
    flat2 = c->rx * c->rx + c->ry * c->ry;
    along = c->x * c->rx + c->y * c->ry;
    across = c->x * c->ry - c->y * c->rx;
    c->foot = -along / flat2;
    half = KIN_POLAR_CORE * KIN_POLAR_CORE * flat2 - across * across;
    half = half > 0. ? sqrt(half) / flat2 : 0.;
    c->enter = c->foot - half;
    c->leave = c->foot + half;
}

/* The part of a line between two places that lies outside of the core. */
static int
emit_outside(struct itersolve *is, const struct trapseg *seg,
             const struct course *c, double from, double to)
{
    double s = trapseg_get_distance(seg, from);
    double x = c->x + s * c->rx, y = c->y + s * c->ry;
    struct line l = {
        .origin = s, .angle = find_angle(is, x, y),
        .dist2 = x * x + y * y, .along = x * c->rx + y * c->ry,
        .across = x * c->ry - y * c->rx,
    };

    return emitline_monotone(is, seg, &l, get_angle, solve_place, from, to);
}

/* Turn evenly to the angle at which the line leaves the core. */
static int
emit_turn(struct itersolve *is, const struct trapseg *seg,
          const struct course *c, double from, double to)
{
    struct kin_polar *k = (struct kin_polar *)is;
    struct quadratic q = { .time = seg->time };
    double end, rate;

    if (k->turn_time != seg->time) {
        k->turn_time = seg->time;
        k->turn_place = trapseg_get_distance(seg, from);
        k->turn_angle = itersolve_get_commanded_pos(is);
    }
    if (!(c->leave > k->turn_place))
        return 0;
    end = find_angle(is, c->x + c->leave * c->rx, c->y + c->leave * c->ry);
    rate = (end - k->turn_angle) / (c->leave - k->turn_place);
    q.p0 = itersolve_to_steps(is, k->turn_angle - rate * k->turn_place);
    q.p1 = rate * seg->start_v * is->inv_step_dist;
    q.p2 = rate * seg->half_accel * is->inv_step_dist;
    return itersolve_emit_quadratic(is, &q, from, to);
}

static double
find_time(const struct trapseg *seg, double s, double from, double to)
{
    return s <= 0. ? from
        : fmin(fmax(trapseg_solve_time(seg, s), from), to);
}

static int
emit(struct itersolve *is, const struct trapseg *seg, double from, double to)
{
    struct course c;
    double enter, foot, leave;
    int ret = 0;

    if (trapseg_is_rest(seg))
        return 0;
    make_course(seg, &c);
    if (!(c.leave > trapseg_get_distance(seg, from)
          && c.enter < trapseg_get_distance(seg, to) && c.leave > c.enter))
        return emit_outside(is, seg, &c, from, to);
    enter = find_time(seg, c.enter, from, to);
    foot = find_time(seg, c.foot, from, to);
    leave = find_time(seg, c.leave, from, to);
    if (enter > from)
        ret = emit_outside(is, seg, &c, from, enter);
    if (!ret && leave > foot)
        ret = emit_turn(is, seg, &c, foot, leave);
    if (!ret && to > leave)
        ret = emit_outside(is, seg, &c, leave, to);
    return ret;
}

static int
check(const struct itersolve *is)
{
    const struct kin_polar *k = (const struct kin_polar *)is;

    if (!isfinite(k->turn_time + k->turn_place + k->turn_angle))
        return -62;
    /* a turn begins within steps made, at a place on its segment */
    return k->turn_time > is->done_time || k->turn_place < 0. ? -63 : 0;
}

static const struct itersolve_kind kind = {
    .get_position = get_position, .emit = emit, .period = TURN,
    .check = check,
    .core = KIN_POLAR_CORE,
};

struct kin_polar *
kin_polar_new(void)
{
    struct kin_polar *k = calloc(1, sizeof(*k));

    if (!k)
        return NULL;
    k->turn_time = -1.;
    itersolve_init(&k->is, &kind, ITERSOLVE_X | ITERSOLVE_Y);
    return k;
}
