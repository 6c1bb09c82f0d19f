/* SPDX-License-Identifier: GPL-3.0-or-later
 * Queue of planned segments.  See trapq.h. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "trapq.h"

enum { RING_MIN = 64 };

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
    if (tq->end - tq->oldest + count <= tq->mask + 1)
        return 0;
    return resize(tq, 2 * (tq->mask + 1));
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

/* A phase of the move, which is `distance` along its line so far. */
static double
push_phase(struct trapq *tq, const struct trap_move *m, double duration,
           double start_v, double half_accel, double distance)
{
    struct trapseg *seg;

    if (duration <= 0.)
        return distance;
    seg = push(tq, tq->end_time, duration);
    seg->start_v = start_v;
    seg->half_accel = half_accel;
    for (int i = 0; i < 3; i++) {
        seg->axes_r[i] = m->axes_r[i];
        seg->start[i] = m->start[i] + m->axes_r[i] * distance;
    }
    return distance + trapseg_get_distance(seg, duration);
}

static int
is_sane(double print_time, const struct trap_move *m)
{
    double sum = print_time + m->accel_t + m->cruise_t + m->decel_t
        + m->start_v + m->cruise_v + m->accel;

    for (int i = 0; i < 3; i++)
        sum += m->start[i] + m->axes_r[i];
    return isfinite(sum) && m->accel_t >= 0. && m->cruise_t >= 0.
        && m->decel_t >= 0.;
}

int
trapq_add(struct trapq *tq, double print_time, const struct trap_move *m)
{
    double half_accel = .5 * m->accel, distance = 0.;

    if (!is_sane(print_time, m))
        return -EINVAL;
    if (reserve(tq, 4))
        return -ENOMEM;
    push_rest(tq, print_time, m->start);
    distance = push_phase(tq, m, m->accel_t, m->start_v, half_accel, 0.);
    distance = push_phase(tq, m, m->cruise_t, m->cruise_v, 0., distance);
    push_phase(tq, m, m->decel_t, m->cruise_v, -half_accel, distance);
    return 0;
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
        if (!(seg->duration >= 0.))
            return -3;
        if (fabs(trapseg_get_end(seg) - next) > 1e-9)
            return -4;
    }
    return 0;
}
