/* SPDX-License-Identifier: GPL-3.0-or-later
 * Parts of the filament.  See driveplan.h. */
#include <math.h>
#include <string.h>

#include "driveplan.h"

/* Channels of the speed come after those of the place. */
#define SPEED_CHANNEL DRIVE_PARTS_MAX

/* A channel on a segment: filament, led by `lead` s of its speed. */
struct motion {
    double v, h, lead;
};

void
driveplan_init(struct drive_plan *plan, const struct advance_list *settings)
{
    memset(plan, 0, sizeof(*plan));
    plan->settings = settings;
    plan->n_parts = 1;
}

/* ---- Shares ---- */

static int
is_shaped(const struct shaper_axis *s)
{
    return s->n_impulses > 0 || s->n_coeffs > 0;
}

static void
add_axis(struct drive_plan *plan, const struct shaper_path *path, int axis)
{
    int alike = 0;

    while (alike < axis && !shaper_path_is_same(path, alike, axis))
        alike++;
    for (int i = 1; i < plan->n_parts; i++)
        if (plan->parts[i].axes & (1u << alike)) {
            plan->parts[i].axes |= 1u << axis;
            return;
        }
    plan->parts[plan->n_parts++] = (struct drive_part) {
        1u << axis, path->axes[axis],
    };
}

void
driveplan_set_shaper(struct drive_plan *plan, const struct shaper_path *path,
                     const struct trapq *head)
{
    plan->head = head;
    plan->n_parts = 1;
    plan->pre = plan->post = 0.;
    plan->ahead = 0;
    if (!path || !head)
        return;
    for (int axis = 0; axis < 3; axis++)
        if (is_shaped(&path->axes[axis]))
            add_axis(plan, path, axis);
    plan->pre = path->pre;
    plan->post = path->post;
}

/* The head's move during a segment of the filament; NULL if it rests. */
static const struct trapseg *
find_head(struct drive_plan *plan, uint64_t number,
          const struct trapseg *seg)
{
    const struct trapq *head = plan->head;
    uint64_t i = trapq_find(head, number + plan->ahead,
                            seg->time + .5 * seg->duration);

    plan->ahead = i - number;
    if (i >= head->end || trapseg_is_rest(trapq_get(head, i)))
        return NULL;
    return trapq_get(head, i);
}

/* Axes that a part shapes; of part 0 those of all others. */
static unsigned int
get_axes(const struct drive_plan *plan, int part)
{
    unsigned int axes = plan->parts[part].axes;

    for (int i = 1; i < plan->n_parts && !part; i++)
        axes |= plan->parts[i].axes;
    return axes;
}

/* Share of the axes of a part; of what no part shapes for part 0. */
static double
get_share(struct drive_plan *plan, int part, uint64_t number,
          const struct trapseg *seg)
{
    const struct trapseg *head;
    unsigned int axes = get_axes(plan, part);
    double of_axes = 0., all = 0.;

    if (plan->n_parts == 1)
        return 1.;
    head = find_head(plan, number, seg);
    if (!head)
        return part ? 0. : 1.;
    for (int axis = 0; axis < 3; axis++) {
        double square = head->axes_r[axis] * head->axes_r[axis];
        all += square;
        of_axes += axes & (1u << axis) ? square : 0.;
    }
    return part ? of_axes / all : 1. - of_axes / all;
}

/* ---- The source ---- */

static int
has_segment(const struct trapq *tq, uint64_t number)
{
    return number >= tq->oldest && number < tq->end;
}

/* A part's motion on a segment. */
static struct motion
get_motion(struct drive_plan *plan, int part, uint64_t number)
{
    struct motion m = { 0., 0., 0. };
    const struct trapseg *seg;
    double r;

    if (!has_segment(plan->tq, number))
        return m;
    seg = trapq_get(plan->tq, number);
    r = seg->axes_r[0];
    if (r == 0. || trapseg_is_rest(seg))
        return m;
    if (plan->n_parts > 1)
        r *= get_share(plan, part, number, seg);
    m.v = r * seg->start_v;
    m.h = r * seg->half_accel;
    m.lead = seg->axes_r[1] != 0.
        ? advancelist_find(plan->settings, seg->time)->advance : 0.;
    return m;
}

/* ---- Arcs ---- */

/* By how much a part's share, summed up over the way, swings around an even
 * growth: signs are those of the two axes of the plane.  With d the angle turned,
 * the integral of cos^2 is s / 2 + swing, that of sin^2 s / 2 - swing. */
static double
get_swing(const struct trapseg *head, double s)
{
    double a = head->axes_r[(head->normal + 1) % 3];
    double b = head->axes_r[(head->normal + 2) % 3];
    double turned = head->turn * s, sine = sin(turned);

    return sine * ((a * a - b * b) * cos(turned) - 2. * a * b * sine)
        / (2. * head->turn);
}

/* Which way a part's share swings on an arc: 0 if it has both axes of the plane,
 * or neither. */
static int
get_side(const struct drive_plan *plan, int part, const struct trapseg *head)
{
    unsigned int axes = get_axes(plan, part);
    int side = (int)(axes >> (head->normal + 1) % 3 & 1)
        - (int)(axes >> (head->normal + 2) % 3 & 1);

    return part ? side : -side;
}

/* Mean share of a part over whole turns. */
static double
get_even_share(const struct drive_plan *plan, int part,
               const struct trapseg *head)
{
    unsigned int axes = get_axes(plan, part);
    double along = head->axes_r[head->normal] * head->axes_r[head->normal];
    double share = 0.;

    for (unsigned int axis = 0; axis < 3; axis++)
        if (axes & (1u << axis))
            share += axis == head->normal ? along : .5 * (1. - along);
    return part ? share : 1. - share;
}

/* A part's filament on an arc, from 0 at its start. */
static void
fit_arc(const struct drive_plan *plan, int part, const struct trapseg *seg,
        const struct trapseg *head, double p[KINK_SIZE])
{
    double pace = seg->axes_r[0] * trapseg_get_distance(seg, seg->duration)
        / trapseg_get_distance(head, head->duration);
    double even = get_even_share(plan, part, head);
    int side = get_side(plan, part, head);

    for (int i = 0; i < KINK_SIZE; i++) {
        double s = trapseg_get_distance(head, trapseg_nodes[i]
                                        * head->duration);
        p[i] = pace * (even * s + side * get_swing(head, s));
    }
    trapseg_fit_values(p, head->duration);
}

/* The head's arc on a segment, if the share of a part changes there. */
static const struct trapseg *
find_arc(struct drive_plan *plan, int part, uint64_t number)
{
    const struct trapseg *seg, *head;

    if (plan->n_parts == 1 || !has_segment(plan->tq, number))
        return NULL;
    seg = trapq_get(plan->tq, number);
    if (seg->axes_r[0] == 0. || trapseg_is_rest(seg))
        return NULL;
    head = find_head(plan, number, seg);
    return head && head->turn != 0. && get_side(plan, part, head) ? head
        : NULL;
}

static int
is_led(const struct trapq *tq, uint64_t number)
{
    return has_segment(tq, number) && trapq_get(tq, number)->axes_r[1] != 0.;
}

/* A channel `t` s after the start of any segment, from 0 there but for the lead:
 * filament that is led, or the speed of what is. */
static void
get_curve(struct drive_plan *plan, int channel, uint64_t number, double t,
          double curve[KINK_SIZE])
{
    int part = channel % SPEED_CHANNEL;
    struct motion m = get_motion(plan, part, number);
    const struct trapseg *head = find_arc(plan, part, number);
    double p[KINK_SIZE + 1] = { 0., m.v, m.h }, rate;

    if (head)
        fit_arc(plan, part, trapq_get(plan->tq, number), head, p);
    poly_shift(p, KINK_SIZE - 1, t);
    p[0] = 0.;
    rate = channel < SPEED_CHANNEL ? m.lead : is_led(plan->tq, number);
    for (int i = 0; i < KINK_SIZE; i++)
        curve[i] = rate * (i + 1) * p[i + 1]
            + (channel < SPEED_CHANNEL ? p[i] : 0.);
}

/* ---- Pieces ---- */

/* Speed of a part as far as it is led (by whatever model). */
static void
get_speed(struct drive_plan *plan, int part, uint64_t number,
          double piece[KINK_SIZE])
{
    struct motion m = get_motion(plan, part, number);
    int counts = is_led(plan->tq, number);

    piece[0] = counts ? m.v : 0.;
    piece[1] = counts ? 2. * m.h : 0.;
    piece[2] = 0.;
}

/* Filament position without lead at the start of a segment. */
static double
get_nominal(const struct trapq *tq, uint64_t number)
{
    const struct trapseg *seg;

    if (number < tq->end)
        return trapq_get(tq, number)->start[0];
    seg = trapq_get(tq, tq->end - 1);
    return seg->start[0] + seg->axes_r[0]
        * trapseg_get_distance(seg, seg->duration);
}

static int
get_piece(const struct kink_source *source, int channel, uint64_t number,
          int is_rest, double piece[KINK_SIZE])
{
    struct drive_plan *plan = (struct drive_plan *)source->data;
    struct motion m = { 0., 0., 0. };

    if (!is_rest && find_arc(plan, channel % SPEED_CHANNEL, number)) {
        get_curve(plan, channel, number, 0., piece);
        piece[0] += channel ? 0. : get_nominal(source->tq, number);
        return KINK_SIZE;
    }
    if (channel >= SPEED_CHANNEL) {
        get_speed(plan, channel - SPEED_CHANNEL,
                  is_rest ? source->tq->end : number, piece);
        return 3;
    }
    if (!is_rest)
        m = get_motion(plan, channel, number);
    piece[0] = (channel ? 0. : get_nominal(source->tq, number))
        + m.lead * m.v;
    piece[1] = m.v + 2. * m.lead * m.h;
    piece[2] = m.h;
    return 3;
}

/* By how much the filament's position is another one at a border. */
static double
get_gap(const struct trapq *tq, uint64_t number)
{
    const struct trapseg *a = trapq_get(tq, number - 1);

    return get_nominal(tq, number) - (a->start[0] + a->axes_r[0]
                                      * trapseg_get_distance(a, a->duration));
}

/* A jump at an end of an arc. */
static void
get_arc_jump(struct drive_plan *plan, int channel, uint64_t number,
             int is_first, double jump[KINK_SIZE])
{
    double before[KINK_SIZE];

    get_curve(plan, channel, number, 0., jump);
    if (is_first)
        return;
    get_curve(plan, channel, number - 1,
              trapq_get(plan->tq, number - 1)->duration, before);
    for (int i = 0; i < KINK_SIZE; i++)
        jump[i] -= before[i];
    if (!channel)
        jump[0] += get_gap(plan->tq, number);
}

static int
get_jump(const struct kink_source *source, int channel, uint64_t number,
         int is_first, double jump[KINK_SIZE])
{
    struct drive_plan *plan = (struct drive_plan *)source->data;
    double t = is_first ? 0. : trapq_get(source->tq, number - 1)->duration;
    struct motion a = { 0., 0., 0. }, b;
    int part = channel % SPEED_CHANNEL;

    if (find_arc(plan, part, number)
        || (!is_first && find_arc(plan, part, number - 1))) {
        get_arc_jump(plan, channel, number, is_first, jump);
        return KINK_SIZE;
    }
    if (channel >= SPEED_CHANNEL) {
        double before[KINK_SIZE] = { 0. };
        channel -= SPEED_CHANNEL;
        get_speed(plan, channel, number, jump);
        if (!is_first)
            get_speed(plan, channel, number - 1, before);
        jump[0] -= before[0] + before[1] * t;
        jump[1] -= before[1];
        return 3;
    }
    b = get_motion(plan, channel, number);
    if (!is_first)
        a = get_motion(plan, channel, number - 1);
    a.v += 2. * a.h * t;
    jump[0] = b.lead * b.v - a.lead * a.v;
    jump[1] = b.v - a.v + 2. * (b.lead * b.h - a.lead * a.h);
    jump[2] = b.h - a.h;
    if (!channel && !is_first)
        jump[0] += get_gap(source->tq, number);
    return 3;
}

void
driveplan_make_path(struct drive_path *path, struct drive_plan *plan,
                    const struct advance_state *state, uint64_t hint)
{
    int is_bent = state->bend.offset != 0.;

    path->source = (struct kink_source) { plan->tq, plan, get_piece,
                                          get_jump };
    kinkpath_init(&path->kinks, &path->source,
                  is_bent ? DRIVE_POLYS : DRIVE_POLYS - 1, -INFINITY,
                  hint);
    for (int i = 0; i < plan->n_parts; i++) {
        reply_make(&path->replies[i], &plan->parts[i].shaper, state->half);
        kinkpath_add(&path->kinks, i, DRIVE_PLACE, &path->replies[i]);
        if (is_bent)
            kinkpath_add(&path->kinks, SPEED_CHANNEL + i, DRIVE_SPEED,
                         &path->replies[i]);
    }
}

int
driveplan_check(const struct drive_plan *plan)
{
    unsigned int seen = 0;

    if (plan->n_parts < 1 || plan->n_parts > DRIVE_PARTS_MAX
        || plan->parts[0].axes || is_shaped(&plan->parts[0].shaper))
        return -70;
    if (plan->n_parts > 1 && !plan->head)
        return -71;
    for (int i = 1; i < plan->n_parts; i++) {
        if (shaper_axis_check(&plan->parts[i].shaper)
            || !plan->parts[i].axes || (plan->parts[i].axes & seen))
            return -72;
        seen |= plan->parts[i].axes;
    }
    return 0;
}
