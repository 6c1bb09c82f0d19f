/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Find the longest runs of steps that one (interval, count, add) describes.
 *
 * Step k of a run (k = 1, 2, ...) comes at
 *     start + interval * k + add * k * (k - 1) / 2
 * and must lie in its window [lo, hi] of clocks.  Windows are given one after
 * the other and must not overlap (what does is cut off), so the intervals
 * within and between runs stay positive.
 *
 * How: dividing by k, the line y = interval + add * x must stab the segments
 * [lo / k, hi / k] at x = (k - 1) / 2.  The (add, interval) that do form a
 * convex polygon, which every window clips.  Once few whole numbers `add` are
 * left in it each of these is tracked by itself, in whole numbers, with the
 * range of intervals that still meets every window; the run ends where the
 * last range becomes empty.  Each window is looked at a bounded number of
 * times.  Nothing is allocated, no run is given out unverified.
 */
#ifndef RUNFIT_H
#define RUNFIT_H

#include <stdint.h>

enum {
    RUNFIT_STORE = 256,         /* windows that wait for a decision */
    RUNFIT_CORNERS = 24,
    RUNFIT_TRACKS = 3,
    RUNFIT_COUNT_MAX = 65535,
};

struct runfit_window {
    int64_t lo, hi;
};

struct steprun {
    int64_t start, end;         /* clocks of the step before and the last */
    uint32_t interval;
    uint16_t count;
    int16_t add;
};

struct runfit_corner {
    double add, interval;
};

/* One add, the intervals that meet all windows so far, and where the steps
 * are with the least and the greatest of them. */
struct runfit_track {
    int64_t add, interval_lo, interval_hi;
    int64_t clock_lo, clock_hi; /* of the newest step, from start */
    int64_t ahead_lo, ahead_hi; /* from there to the step after */
};

struct runfit {
    int64_t start, last_mid, last_hi;
    int64_t n_fit;              /* windows of the run so far */
    int n_stored, n_corners, n_tracks, side;
    uint8_t is_closing;
    struct runfit_track tracks[RUNFIT_TRACKS];
    struct runfit_corner corners[2][RUNFIT_CORNERS];
    struct runfit_window stored[RUNFIT_STORE];
};

/* Forget everything; the next run counts from this clock. */
void runfit_reset(struct runfit *f, int64_t start);

/* Add the window of the next step.  Returns 1 when a run is complete:
 * runfit_take() until it returns 0 before the next one. */
int runfit_add(struct runfit *f, int64_t lo, int64_t hi);

/* Let runfit_take() give out everything that was added. */
void runfit_close(struct runfit *f);

/* Take a complete run.  Returns 1, or 0 when there is none. */
int runfit_take(struct runfit *f, struct steprun *run);

static inline int
runfit_is_empty(const struct runfit *f)
{
    return f->n_fit == 0 && f->n_stored == 0;
}

/* Clock of the first open window's earliest moment; not when empty. */
int64_t runfit_get_first(const struct runfit *f);

/* 0, or a negative number that says which invariant does not hold. */
int runfit_check(const struct runfit *f);

#endif
