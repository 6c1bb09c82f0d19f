/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Paths that are averages of a plan, as polynomials that follow each other.
 *
 * A plan is polynomials from border to border of segments, of degree two, or
 * four along arcs; what changes there are its kinks.  An average makes of each kink a few events (see
 * reply.h): between events the path is one polynomial, and an event adds
 * another to it.  So each border costs the same, however many segments the
 * average sees.  Now and then all is made anew, as rounding adds up.
 *
 * One path may have a few polynomials (x, y and z, say), each the sum of some
 * channels of the plan, each channel with an average of its own.
 *
 * A border where nothing jumps is mostly no event.  The plan must stay as it is from
 * kinkpath_start() on for as long as kinkpath_move() follows.
 *
 * Units: s, print_time; otherwise those of the source.
 */
#ifndef KINKPATH_H
#define KINKPATH_H

#include "reply.h"
#include "trapq.h"

enum {
    KINK_POLYS = 3, KINK_LINES_MAX = 8, KINK_TAPS_MAX = 96,
    KINK_KEPT = 64,             /* kinks that a line remembers */
    KINK_SKIP = 8,              /* borders without one that are passed at once */
};

struct kink_source {
    const struct trapq *tq;
    const void *data;
    /* A channel on segment `number` by power of the time since its start;
     * is_rest: of a machine that rests there.  It always does at tq->end.
     * Returns how many are set, 3 or KINK_SIZE. */
    int (*get_piece)(const struct kink_source *source, int channel,
                     uint64_t number, int is_rest, double piece[KINK_SIZE]);
    /* How these jump at the start of segment `number`; is_first: what was
     * before counts as rest. */
    int (*get_jump)(const struct kink_source *source, int channel,
                    uint64_t number, int is_first, double jump[KINK_SIZE]);
};

/* What jumps at a border: jump[i] * t^i; how many of them count. */
struct kink {
    double jump[KINK_SIZE];
    int n, is_flat;             /* nothing jumps */
    uint64_t number;            /* of the segment that begins there */
    double border;              /* when that is */
};

struct kink_line {
    int channel, poly;
    const struct reply *reply;
    struct kink kept[KINK_KEPT];        /* by the last bits of the number */
};

struct kink_tap {
    struct kink_line *line;
    const struct reply_event *event;
    uint64_t cursor;            /* number of the segment at the next event */
    double next;                /* when that is */
};

struct kinkpath {
    const struct kink_source *source;
    int n_lines, n_taps, n_polys;
    int degree, plain_degree;   /* now, and without arcs */
    struct kink_line lines[KINK_LINES_MAX];
    struct kink_tap taps[KINK_TAPS_MAX];
    double reach;               /* s: greatest delay */
    double lasting;             /* s until all is made anew */
    double barrier;             /* what was before this does not count */
    uint64_t first;             /* of segments, if it begins there */
    uint64_t hint;              /* number of the oldest that counted */
    double time;                /* of t = 0 */
    double renew_time;
    double end;                 /* of the next event */
    double q[KINK_POLYS][POLY_SIZE];
};

/* Without lines.  source must stay; hint is any number of a segment. */
void kinkpath_init(struct kinkpath *p, const struct kink_source *source,
                   int n_polys, double barrier, uint64_t hint);
/* Add a channel's average to a polynomial; reply must stay. */
void kinkpath_add(struct kinkpath *p, int channel, int poly,
                  const struct reply *reply);
/* Have the polynomials tell the path from `time` on.  Anywhere. */
void kinkpath_start(struct kinkpath *p, double time);
/* As before, for a time at or after the last one. */
void kinkpath_move(struct kinkpath *p, double time);
/* Until when (after p->time) the polynomials hold. */
static inline double
kinkpath_get_end(const struct kinkpath *p)
{
    return p->end;
}

/* Nothing changes, until an event. */
int kinkpath_is_at_rest(const struct kinkpath *p);
/* 0, or a negative number that says which invariant does not hold. */
int kinkpath_check(const struct kinkpath *p);

#endif
