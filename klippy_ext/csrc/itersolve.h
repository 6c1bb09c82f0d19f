/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * From planned segments to the times of one stepper's steps.
 *
 * A stepper that counts n steps is right while its exact position is within
 * half a step of origin + n * step_dist; it steps at the moment when the
 * position leaves that range.  A path that swings across a border therefore
 * steps forth and back at the same position, each crossing at its own time.
 * Counting is in whole steps: nothing drifts.  Positions that lie outside the
 * range by less than STEP_SLACK count as inside, so rounding never steps.
 *
 * A kind of kinematics is a struct itersolve_kind.  All times are solved for,
 * never searched, where the position is a polynomial of degree two in time
 * (itersolve_emit_quadratic()) or along the line; see kin_*.c.
 *
 * Units: mm, s, print_time.  One thread at a time for each itersolve.
 */
#ifndef ITERSOLVE_H
#define ITERSOLVE_H

#include <stdint.h>

#include "trapq.h"

struct itersolve;
struct shaper_path;
struct stepcompress;

enum { ITERSOLVE_X = 1, ITERSOLVE_Y = 2, ITERSOLVE_Z = 4 };

enum {
    ITERSOLVE_EJUMP = -1000,    /* the position jumps by too many steps */
    ITERSOLVE_JUMP_MAX = 16,
};

#define STEP_SLACK 1e-6         /* of a step */

struct itersolve_kind {
    /* Stepper position (mm) of a resting machine. */
    double (*get_position)(const struct itersolve *is, const double pos[3]);
    /* Make the steps of a segment between two times from its start. */
    int (*emit)(struct itersolve *is, const struct trapseg *seg,
                double from, double to);
    /* As emit, of an arc; or NULL, which has it fitted by arcfit_emit(). */
    int (*emit_arc)(struct itersolve *is, const struct trapseg *seg,
                    double from, double to);
    /* Instead of emit, where it depends on more than one segment; or NULL. */
    int (*emit_range)(struct itersolve *is, double start, double end);
    /* As itersolve_check(), for what is its own; or NULL. */
    int (*check)(const struct itersolve *is);
    /* Where the position is weights . pos + offset; or NULL. */
    void (*get_weights)(const struct itersolve *is, double weights[3],
                        double *offset);
    double period;              /* of positions that are angles; or 0 */
    double core;                /* mm from x = y = 0: see shapercore.h; or 0 */
};

/* First member of every kinematics. */
struct itersolve {
    const struct itersolve_kind *kind;
    const struct trapq *tq;
    struct stepcompress *sc;
    double step_dist, inv_step_dist;
    double origin;              /* mm, where n_steps is 0 */
    int64_t n_steps;
    double done_time;           /* steps are made up to here */
    uint64_t cursor;            /* number of the segment there */
    double scan_pre, scan_post; /* s of segments needed around a time */
    uint32_t active_axes;       /* ITERSOLVE_X ... that move this stepper */
    struct shaper_path *path;   /* followed instead of the plan; or NULL */
};

/* Stepper position in steps as a polynomial: p0 + (p1 + p2 * t) * t. */
struct quadratic {
    double time;                /* print_time of t = 0 */
    double p0, p1, p2;
};

void itersolve_init(struct itersolve *is, const struct itersolve_kind *kind,
                    uint32_t active_axes);
void itersolve_set_trapq(struct itersolve *is, const struct trapq *tq);
void itersolve_set_stepcompress(struct itersolve *is, struct stepcompress *sc,
                                double step_dist);
/* The stepper stands right for this position; no steps are made. */
void itersolve_set_position(struct itersolve *is, const double pos[3]);
double itersolve_calc_position(const struct itersolve *is,
                               const double pos[3]);
double itersolve_get_commanded_pos(const struct itersolve *is);
int itersolve_is_active_axis(const struct itersolve *is, char axis);
/* print_time at which the first segment begins, after the steps made and up
 * to `until`, that may move the stepper; 0 if there is none. */
double itersolve_find_active(const struct itersolve *is, double until);

/* Make all steps up to print_time.  Returns 0, -ENOMEM or -EJUMP. */
int itersolve_generate(struct itersolve *is, double print_time);

/* 0, or a negative number that says which invariant does not hold. */
int itersolve_check(const struct itersolve *is);

/* ---- For the kinds ---- */

/* Can the segment move this stepper? */
static inline int
itersolve_is_moved_by(const struct itersolve *is, const struct trapseg *seg)
{
    uint32_t axes = (seg->axes_r[0] != 0. ? ITERSOLVE_X : 0u)
        | (seg->axes_r[1] != 0. ? ITERSOLVE_Y : 0u)
        | (seg->axes_r[2] != 0. ? ITERSOLVE_Z : 0u);

    if (seg->turn != 0.)
        axes |= 7u & ~(1u << seg->normal);
    return (axes & is->active_axes) != 0;
}

static inline double
itersolve_to_steps(const struct itersolve *is, double position)
{
    return (position - is->origin) * is->inv_step_dist;
}

/* Steps to make on a way that ends at `steps` and only rises (dir 1) or falls
 * (dir -1); 0 or less if it stays in the range. */
static inline int64_t
itersolve_count_to(const struct itersolve *is, double steps, int dir)
{
    double ahead = dir * (steps - (double)is->n_steps);

    return ahead < .5 ? 0 : (int64_t)(ahead + .5);
}

/* Position in steps at which step `i` (0, 1, ...) ahead happens. */
static inline double
itersolve_get_level(const struct itersolve *is, int64_t i, int dir)
{
    return (double)is->n_steps + dir * ((double)i + .5);
}

/* Make up for a position that jumped; first of all on a piece. */
int itersolve_align(struct itersolve *is, double time, double steps);
int itersolve_emit_quadratic(struct itersolve *is, const struct quadratic *q,
                             double from, double to);
/* n print_times, in order, of steps in one direction. */
int itersolve_push(struct itersolve *is, const double *times, int n, int dir);

#endif
