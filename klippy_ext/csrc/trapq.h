/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What the planner decided: segments of constant acceleration along straight
 * lines and arcs, without gaps in time.
 *
 * Segments live in one ring, numbered without end, in order of time:
 * [oldest, live) is history (kept for reports), [live, end) is still needed to
 * make steps.  A time in which nothing moves is a segment too (axes_r all 0,
 * see trapq_is_rest()).  After the last segment the machine rests where that
 * ends.  Numbers stay valid while the segment exists; look up by time with
 * trapq_find(), which accepts any old number as a hint.
 *
 * On an arc the direction turns by the same angle each mm of the way, in the
 * plane at right angles to the axis `normal`; what it has along that axis
 * stays, so that an arc may be a helix.  Turns are positive from x to y, from
 * y to z and from z to x.  Each phase of an arc is cut into segments of equal
 * time, so short that over each the place is a polynomial of degree four in
 * time, but for TRAPQ_ARC_ERROR: see trapseg_fit().
 *
 * Units: mm, s, print_time.  No locks: planner and step generation take turns.
 */
#ifndef TRAPQ_H
#define TRAPQ_H

#include <math.h>
#include <stdint.h>

struct trapseg {
    double time, duration;      /* print_time of its start; s */
    double start_v, half_accel;
    double start[3], axes_r[3]; /* place and direction at its start */
    double turn;                /* rad a mm of the way; 0: a straight line */
    uint32_t normal;            /* 0, 1, 2; of an arc */
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
    double turn;                /* as in struct trapseg */
    uint32_t normal;
};

/* A straight piece of a segment; direction in mm a mm of the way. */
struct trap_record {
    double print_time, move_t, start_v, accel;
    double start[3], axes_r[3];
};

#define TRAPQ_CHORD_ERROR .005  /* mm */
#define TRAPQ_ARC_ERROR 5e-9    /* mm */

/* NULL when out of memory. */
struct trapq *trapq_new(void);
void trapq_delete(struct trapq *tq);

/* Append a move.  A time between the last move and this one becomes rest at
 * this one's start.  Returns 0, -ENOMEM (queue unchanged), or -EINVAL for
 * values that are not finite, phases of negative length or a normal that is
 * no axis. */
int trapq_add(struct trapq *tq, double print_time,
              const struct trap_move *move);
/* The same, cut at the times at which `like` is cut (an arc that takes as
 * long). */
int trapq_add_like(struct trapq *tq, double print_time,
                   const struct trap_move *move,
                   const struct trap_move *like);

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

/* weights . place over a segment of an arc, by power of the time since its
 * start: exact at both ends. */
void trapseg_fit(const struct trapseg *seg, const double weights[3],
                 double fit[5]);
/* By the same nodes, and the same powers: values at trapseg_nodes[] (shares of
 * `duration`) become a polynomial in place. */
extern const double trapseg_nodes[5];
void trapseg_fit_values(double fit[5], double duration);

/* Copy moves that overlap (start_time, end_time), newest first, at most max;
 * returns their number.  Arcs are told as chords that are at most
 * TRAPQ_CHORD_ERROR off, and pass them in the same time. */
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

/* Time from the start to a place on the way; 1e-300 is for 0 / 0. */
static inline double
trapseg_solve_time(const struct trapseg *seg, double s)
{
    double inside = seg->start_v * seg->start_v + 4. * seg->half_accel * s;

    return 2. * s / (seg->start_v + sqrt(fmax(inside, 0.)) + 1e-300);
}

/* Where the head is after s mm. */
static inline void
trapseg_get_place(const struct trapseg *seg, double s, double pos[3])
{
    uint32_t a = (seg->normal + 1) % 3, b = (seg->normal + 2) % 3;
    double half = .5 * seg->turn * s, sine = sin(half);
    double along = s, aside = 0.;

    if (seg->turn != 0.) {
        along = 2. * sine * cos(half) / seg->turn;
        aside = 2. * sine * sine / seg->turn;
    }
    for (int i = 0; i < 3; i++)
        pos[i] = seg->start[i] + seg->axes_r[i] * s;
    pos[a] = seg->start[a] + seg->axes_r[a] * along - seg->axes_r[b] * aside;
    pos[b] = seg->start[b] + seg->axes_r[b] * along + seg->axes_r[a] * aside;
}

/* Which way it goes there. */
static inline void
trapseg_get_direction(const struct trapseg *seg, double s, double r[3])
{
    uint32_t a = (seg->normal + 1) % 3, b = (seg->normal + 2) % 3;
    double cosine = cos(seg->turn * s), sine = sin(seg->turn * s);

    r[seg->normal] = seg->axes_r[seg->normal];
    r[a] = seg->axes_r[a] * cosine - seg->axes_r[b] * sine;
    r[b] = seg->axes_r[b] * cosine + seg->axes_r[a] * sine;
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
