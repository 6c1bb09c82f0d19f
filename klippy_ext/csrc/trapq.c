/* SPDX-License-Identifier: GPL-3.0-or-later
 * Queue of planned segments.  See trapq.h. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "trapq.h"

enum { RING_MIN = 64, ARC_PARTS_MAX = 10000 };

struct trapq *
trapq_new(void)
{
    struct trapq *tq = calloc(1, sizeof(*tq));

    if (!tq)
        return NULL;
    tq->ring = malloc(RING_MIN * sizeof(*tq->ring));
    if (!tq->ring) {
        free(tq);
        return NULL;
    }
    tq->mask = RING_MIN - 1;
    return tq;
}

void
trapq_delete(struct trapq *tq)
{
    if (!tq)
        return;
    free(tq->ring);
    free(tq);
}

static int
resize(struct trapq *tq, uint64_t size)
{
    struct trapseg *ring = malloc(size * sizeof(*ring));

    if (!ring)
        return -ENOMEM;
    for (uint64_t i = tq->oldest; i < tq->end; i++)
        ring[i & (size - 1)] = *trapq_get(tq, i);
    free(tq->ring);
    tq->ring = ring;
    tq->mask = size - 1;
    return 0;
}

static int
reserve(struct trapq *tq, uint64_t count)
{
    uint64_t size = tq->mask + 1;

    while (tq->end - tq->oldest + count > size)
        size *= 2;
    return size == tq->mask + 1 ? 0 : resize(tq, size);
}

static struct trapseg *
push(struct trapq *tq, double time, double duration)
{
    struct trapseg *seg = &tq->ring[tq->end++ & tq->mask];

    memset(seg, 0, sizeof(*seg));
    seg->time = time;
    seg->duration = duration;
    tq->end_time = time + duration;
    return seg;
}

/* Nothing moves until print_time. */
static void
push_rest(struct trapq *tq, double print_time, const double pos[3])
{
    struct trapseg *rest;

    if (print_time <= tq->end_time)
        return;
    rest = push(tq, tq->end_time, print_time - tq->end_time);
    memcpy(rest->start, pos, sizeof(rest->start));
    tq->end_time = print_time;
}

/* The segment is `distance` after the start of an arc. */
static void
bend(struct trapseg *seg, const struct trap_move *m, double distance)
{
    struct trapseg whole = { .turn = m->turn, .normal = m->normal };

    memcpy(whole.start, m->start, sizeof(whole.start));
    memcpy(whole.axes_r, m->axes_r, sizeof(whole.axes_r));
    trapseg_get_place(&whole, distance, seg->start);
    trapseg_get_direction(&whole, distance, seg->axes_r);
    seg->turn = m->turn;
    seg->normal = m->normal;
}

/* Into how many segments a phase of an arc is cut.  With w = rad/s and b =
 * rad/s^2 the fifth derivative of a place is at most radius * (w^5 + 10 w^3 b +
 * 15 w b^2), of which trapseg_fit() is off by 1 / 1000 times the fifth power of
 * half the time. */
static int
count_parts(const struct trap_move *m, double duration, double start_v,
            double half_accel)
{
    double end_v = start_v + 2. * half_accel * duration;
    double w = fabs(m->turn) * fmax(fabs(start_v), fabs(end_v));
    double b = fabs(m->turn * 2. * half_accel), bend, each;
    double flat = hypot(m->axes_r[(m->normal + 1) % 3],
                        m->axes_r[(m->normal + 2) % 3]);

    if (m->turn == 0. || duration <= 0.)
        return 1;
    bend = flat / fabs(m->turn) * w * (w * w * w * w + 10. * w * w * b
                                       + 15. * b * b);
    each = 2. * pow(1000. * TRAPQ_ARC_ERROR / (bend + 1e-300), .2);
    return (int)fmin(fmax(ceil(duration / each), 1.), ARC_PARTS_MAX);
}

/* A part of a phase, which is `distance` along its line so far. */
static double
push_part(struct trapq *tq, const struct trap_move *m, double duration,
           double start_v, double half_accel, double distance)
{
    struct trapseg *seg = push(tq, tq->end_time, duration);

    seg->start_v = start_v;
    seg->half_accel = half_accel;
    for (int i = 0; i < 3; i++) {
        seg->axes_r[i] = m->axes_r[i];
        seg->start[i] = m->start[i] + m->axes_r[i] * distance;
    }
    if (m->turn != 0.)
        bend(seg, m, distance);
    return distance + trapseg_get_distance(seg, duration);
}

/* A phase of the move, in n segments. */
static double
push_phase(struct trapq *tq, const struct trap_move *m, double duration,
           double start_v, double half_accel, double distance, int n)
{
    double begin = tq->end_time;

    if (duration <= 0.)
        return distance;
    for (int i = 1; i <= n; i++) {
        double t = tq->end_time - begin;
        double until = i < n ? duration * i / n : duration;
        distance = push_part(tq, m, until - t, start_v + 2. * half_accel * t,
                             half_accel, distance);
    }
    return distance;
}

static int
is_sane(double print_time, const struct trap_move *m)
{
    double sum = print_time + m->accel_t + m->cruise_t + m->decel_t
        + m->start_v + m->cruise_v + m->accel + m->turn;

    for (int i = 0; i < 3; i++)
        sum += m->start[i] + m->axes_r[i];
    return isfinite(sum) && m->accel_t >= 0. && m->cruise_t >= 0.
        && m->decel_t >= 0. && m->normal < 3;
}

int
trapq_add_like(struct trapq *tq, double print_time, const struct trap_move *m,
               const struct trap_move *like)
{
    double half_accel = .5 * m->accel, like_half = .5 * like->accel;
    double distance = 0.;
    int n[3];

    if (!is_sane(print_time, m) || !is_sane(print_time, like))
        return -EINVAL;
    n[0] = count_parts(like, like->accel_t, like->start_v, like_half);
    n[1] = count_parts(like, like->cruise_t, like->cruise_v, 0.);
    n[2] = count_parts(like, like->decel_t, like->cruise_v, -like_half);
    if (reserve(tq, 1 + (uint64_t)(n[0] + n[1] + n[2])))
        return -ENOMEM;
    push_rest(tq, print_time, m->start);
    distance = push_phase(tq, m, m->accel_t, m->start_v, half_accel, 0.,
                          n[0]);
    distance = push_phase(tq, m, m->cruise_t, m->cruise_v, 0., distance,
                          n[1]);
    push_phase(tq, m, m->decel_t, m->cruise_v, -half_accel, distance, n[2]);
    return 0;
}

int
trapq_add(struct trapq *tq, double print_time, const struct trap_move *m)
{
    return trapq_add_like(tq, print_time, m, m);
}

const double trapseg_nodes[5] = {
    0., .14644660940672624, .5, .85355339059327376, 1.,
};

void
trapseg_fit(const struct trapseg *seg, const double weights[3],
            double fit[5])
{
    for (int i = 0; i < 5; i++) {
        double t = trapseg_nodes[i] * seg->duration, pos[3];
        trapseg_get_place(seg, trapseg_get_distance(seg, t), pos);
        fit[i] = weights[0] * pos[0] + weights[1] * pos[1]
            + weights[2] * pos[2];
    }
    trapseg_fit_values(fit, seg->duration);
}

/* Newton's form through the nodes, then its powers. */
void
trapseg_fit_values(double fit[5], double duration)
{
    const double *nodes = trapseg_nodes;
    double c[5], inverse = 1. / duration, scale = 1.;

    for (int i = 0; i < 5; i++) {
        c[i] = fit[i];
        fit[i] = 0.;
    }
    for (int k = 1; k < 5; k++)
        for (int i = 4; i >= k; i--)
            c[i] = (c[i] - c[i - 1]) / (nodes[i] - nodes[i - k]);
    for (int k = 4; k >= 0; k--) {
        for (int i = 4; i > 0; i--)
            fit[i] = fit[i - 1] - nodes[k] * fit[i];
        fit[0] = c[k] - nodes[k] * fit[0];
    }
    for (int i = 0; i < 5; i++, scale *= inverse)
        fit[i] *= scale;
}

int
trapq_set_position(struct trapq *tq, double print_time, const double pos[3])
{
    if (!isfinite(print_time + pos[0] + pos[1] + pos[2]))
        return -EINVAL;
    if (reserve(tq, 2))
        return -ENOMEM;
    while (!trapq_is_empty(tq)
           && trapq_get(tq, tq->end - 1)->time >= print_time)
        tq->end--;
    if (!trapq_is_empty(tq)) {
        struct trapseg *last = &tq->ring[(tq->end - 1) & tq->mask];
        last->duration = fmin(last->duration, print_time - last->time);
        tq->end_time = trapseg_get_end(last);
    }
    push_rest(tq, print_time, pos);
    memcpy(push(tq, print_time, 0.)->start, pos, 3 * sizeof(*pos));
    tq->live = tq->end;
    return 0;
}

void
trapq_mark(struct trapq *tq)
{
    tq->mark_end = tq->end;
    tq->mark_time = tq->end_time;
}

void
trapq_rewind(struct trapq *tq)
{
    if (tq->mark_end >= tq->live && tq->mark_end < tq->end) {
        tq->end = tq->mark_end;
        tq->end_time = tq->mark_time;
    }
}

void
trapq_finalize(struct trapq *tq, double print_time, double clear_history_time)
{
    uint64_t size = tq->mask + 1, used;

    while (tq->live < tq->end
           && trapseg_get_end(trapq_get(tq, tq->live)) <= print_time)
        tq->live++;
    /* One stays: it says where the machine rests. */
    while (tq->oldest < tq->live && tq->oldest + 1 < tq->end
           && trapseg_get_end(trapq_get(tq, tq->oldest)) < clear_history_time)
        tq->oldest++;
    used = tq->end - tq->oldest;
    if (size > RING_MIN && used < size / 8)
        (void)resize(tq, size / 2);     /* no memory: stays as it is */
}

static void
copy_record(struct trap_record *out, const struct trapseg *seg)
{
    out->print_time = seg->time;
    out->move_t = seg->duration;
    out->start_v = seg->start_v;
    out->accel = 2. * seg->half_accel;
    memcpy(out->start, seg->start, sizeof(out->start));
    memcpy(out->axes_r, seg->axes_r, sizeof(out->axes_r));
}

/* Into how many chords an arc is cut. */
static int
count_chords(const struct trapseg *seg)
{
    double turned = fabs(seg->turn)
        * trapseg_get_distance(seg, seg->duration);
    double radius = hypot(seg->axes_r[(seg->normal + 1) % 3],
                          seg->axes_r[(seg->normal + 2) % 3])
        / fabs(seg->turn);
    double each = radius < TRAPQ_CHORD_ERROR ? 1.
        : 2. * acos(1. - TRAPQ_CHORD_ERROR / radius);

    return turned > 0. ? (int)fmin(ceil(turned / each), 1e6) : 1;
}

/* Chord number i of n. */
static struct trapseg
cut_chord(const struct trapseg *seg, int i, int n)
{
    double way = trapseg_get_distance(seg, seg->duration);
    double s = way * i / n, next_s = way * (i + 1) / n;
    double t = trapseg_solve_time(seg, s), next_t = seg->duration;
    double end[3];
    struct trapseg chord = { .half_accel = seg->half_accel };

    if (i + 1 < n)
        next_t = trapseg_solve_time(seg, next_s);
    chord.time = seg->time + t;
    chord.duration = next_t - t;
    chord.start_v = seg->start_v + 2. * seg->half_accel * t;
    trapseg_get_place(seg, s, chord.start);
    trapseg_get_place(seg, next_s, end);
    for (int k = 0; k < 3; k++)
        chord.axes_r[k] = next_s > s ? (end[k] - chord.start[k])
            / (next_s - s) : seg->axes_r[k];
    return chord;
}

/* The chords of an arc as trapq_extract() copies moves. */
static int
extract_arc(const struct trapseg *seg, struct trap_record *out, int max,
            double start_time, double end_time)
{
    int count = 0, n = count_chords(seg);

    for (int i = n - 1; i >= 0 && count < max; i--) {
        struct trapseg chord = cut_chord(seg, i, n);
        if (trapseg_get_end(&chord) <= start_time)
            break;
        if (chord.time < end_time)
            copy_record(&out[count++], &chord);
    }
    return count;
}

int
trapq_extract(const struct trapq *tq, struct trap_record *out, int max,
              double start_time, double end_time)
{
    int count = 0;

    for (uint64_t i = tq->end; i > tq->oldest && count < max; i--) {
        const struct trapseg *seg = trapq_get(tq, i - 1);
        if (trapseg_get_end(seg) <= start_time)
            break;
        if (seg->time >= end_time
            || (seg->duration > 0. && trapseg_is_rest(seg)))
            continue;
        if (seg->turn != 0.)
            count += extract_arc(seg, &out[count], max - count, start_time,
                                 end_time);
        else
            copy_record(&out[count++], seg);
    }
    return count;
}

int
trapq_check(const struct trapq *tq)
{
    if (tq->oldest > tq->live || tq->live > tq->end)
        return -1;
    if (tq->end - tq->oldest > tq->mask + 1)
        return -2;
    for (uint64_t i = tq->oldest; i < tq->end; i++) {
        const struct trapseg *seg = trapq_get(tq, i);
        double next = i + 1 < tq->end ? trapq_get(tq, i + 1)->time
                                      : tq->end_time;
        if (!(seg->duration >= 0.) || seg->normal > 2
            || !isfinite(seg->turn))
            return -3;
        if (fabs(trapseg_get_end(seg) - next) > 1e-9)
            return -4;
    }
    return 0;
}
