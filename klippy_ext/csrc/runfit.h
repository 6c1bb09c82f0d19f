/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Find long runs of steps that one (interval, count, add) describes.
 *
 * Step k of a run (k = 1, 2, ...) comes at
 *     start + interval * k + add * k * (k - 1) / 2
 * and must lie within `error` of its wanted clock.  Windows of neighbours must
 * not overlap, so intervals within and between runs stay positive.
 *
 * How: a run of n steps is drawn through its start, its middle and its last
 * step, and the largest n is searched for which that stays within the errors:
 * first by probing a few steps, then by checking each in whole numbers.  To
 * end in the middle of a window pays on a smooth path: a run that is stretched
 * until it leaves the last window leaves a bad start to the next.  Where the
 * path has corners, or where rounding to whole numbers is what counts, it pays
 * to go as far as possible (runline.h).  Of a short run both are tried, and
 * the one is taken after which the next gets further.
 * If everything that is stored fits one run, that run is tracked from then on:
 * for each add that is possible, the range of intervals that still meets all
 * windows.
 *
 * Each window is looked at a bounded number of times.  Nothing is allocated,
 * no run is given out unchecked.
 */
#ifndef RUNFIT_H
#define RUNFIT_H

#include "runline.h"
#include "runtrack.h"

enum {
    RUNFIT_STORE = 1024,        /* windows that wait for a decision */
    RUNFIT_AHEAD = 512,         /* how many a decision should see */
    RUNFIT_TRACKS = 3,
    RUNFIT_COUNT_MAX = 65535,
};

struct steprun {
    int64_t start, end;         /* clocks of the step before and the last */
    uint32_t interval;
    uint16_t count;
    int16_t add;
};

struct runfit {
    int64_t start;
    int64_t n_tracked;          /* steps of the run in tracks */
    double tracked_mid;         /* wanted clock of the last of them */
    int first, end;             /* stored windows that belong to no run */
    int last_count;             /* length of the last run: a guess */
    int n_tracks;               /* 0: no run is tracked */
    struct runtrack tracks[RUNFIT_TRACKS];
    struct runline line;        /* gates of the run that is chosen */
    /* Whole numbers.  Loops may look at or write two more. */
    double wanted[RUNFIT_STORE + 2], error[RUNFIT_STORE + 2];
};

/* Forget everything; the next run counts from this clock. */
void runfit_reset(struct runfit *f, int64_t start);

/* Add the next step's window; not when full. */
static inline void
runfit_put(struct runfit *f, double wanted, double error)
{
    f->wanted[f->end] = wanted;
    f->error[f->end++] = error;
}

static inline int
runfit_is_full(const struct runfit *f)
{
    return f->end == RUNFIT_STORE;
}

/* Take the next run, if enough windows are stored to choose it well.  Returns
 * 1, or 0 when there is none; then there is room again. */
int runfit_take(struct runfit *f, struct steprun *run);

/* Take the next run now if it begins before `limit`.  Returns 1 or 0. */
int runfit_take_before(struct runfit *f, int64_t limit, struct steprun *run);

static inline int
runfit_is_empty(const struct runfit *f)
{
    return f->first == f->end && !f->n_tracks;
}

/* 0, or a negative number that says which invariant does not hold. */
int runfit_check(const struct runfit *f);

#endif
