/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What the planner decided: segments of constant acceleration along straight
 * lines, without gaps in time.
 *
 * Segments live in one ring, numbered without end, in order of time:
 * [oldest, live) is history (kept for reports), [live, end) is still needed to
 * make steps.  A time in which nothing moves is a segment too (axes_r all 0,
 * see trapq_is_rest()).  After the last segment the machine rests where that
 * ends.  Numbers stay valid while the segment exists; look up by time with
 * trapq_find(), which accepts any old number as a hint.
 *
 * Units: mm, s, print_time.  No locks: planner and step generation take turns.
 */
#ifndef TRAPQ_H
#define TRAPQ_H

#include <stdint.h>

struct trapseg {
    double time, duration;      /* print_time of its start; s */
    double start_v, half_accel;
    double start[3], axes_r[3];
};

struct trapq {
    struct trapseg *ring;
    uint64_t mask;              /* size of the ring - 1 */
    uint64_t oldest, live, end;
    double end_time;            /* print_time at which the last one ends */
    uint64_t mark_end;          /* see trapq_mark() */
    double mark_time;
};

/* One move as planned: speed up, cruise, slow down. */
struct trap_move {
    double accel_t, cruise_t, decel_t;
    double start[3], axes_r[3];
    double start_v, cruise_v, accel;
};

struct trap_record {
    double print_time, move_t, start_v, accel;
    double start[3], axes_r[3];
};

/* NULL when out of memory. */
struct trapq *trapq_new(void);
void trapq_delete(struct trapq *tq);

/* Append a move.  A time between the last move and this one becomes rest at
 * this one's start.  Returns 0, -ENOMEM (queue unchanged), or -EINVAL for
 * values that are not finite or phases of negative length. */
int trapq_add(struct trapq *tq, double print_time,
              const struct trap_move *move);

/* From print_time on the position is this: what was planned for later is
 * dropped, and a mark of no duration is left in the history.  Returns as
 * trapq_add(). */
int trapq_set_position(struct trapq *tq, double print_time,
                       const double pos[3]);

/* What is appended from here on may be taken back, until steps are made of it:
 * rewind() makes the queue end where it did at the mark. */
void trapq_mark(struct trapq *tq);
void trapq_rewind(struct trapq *tq);

/* Steps up to print_time are made: those segments become history, of which
 * what ended before clear_history_time is forgotten. */
void trapq_finalize(struct trapq *tq, double print_time,
                    double clear_history_time);

/* Copy moves that overlap (start_time, end_time), newest first, at most max;
 * returns their number. */
int trapq_extract(const struct trapq *tq, struct trap_record *out, int max,
                  double start_time, double end_time);

/* 0, or a negative number that says which invariant does not hold. */
int trapq_check(const struct trapq *tq);

static inline const struct trapseg *
trapq_get(const struct trapq *tq, uint64_t number)
{
    return &tq->ring[number & tq->mask];
}

static inline int
trapq_is_empty(const struct trapq *tq)
{
    return tq->oldest == tq->end;
}

static inline double
trapseg_get_end(const struct trapseg *seg)
{
    return seg->time + seg->duration;
}

/* Distance along the line, `t` s after the start. */
static inline double
trapseg_get_distance(const struct trapseg *seg, double t)
{
    return (seg->start_v + seg->half_accel * t) * t;
}

static inline int
trapseg_is_rest(const struct trapseg *seg)
{
    return seg->start_v == 0. && seg->half_accel == 0.;
}

/* Number of the segment that covers `time`, or tq->end when that is after all
 * of them; the oldest when it is before.  Amortised constant for times that
 * move on with the hint. */
static inline uint64_t
trapq_find(const struct trapq *tq, uint64_t hint, double time)
{
    if (hint < tq->oldest)
        hint = tq->oldest;
    if (hint > tq->end)
        hint = tq->end;
    while (hint > tq->oldest && trapseg_get_end(trapq_get(tq, hint - 1)) > time)
        hint--;
    while (hint < tq->end && trapseg_get_end(trapq_get(tq, hint)) <= time)
        hint++;
    return hint;
}

#endif
