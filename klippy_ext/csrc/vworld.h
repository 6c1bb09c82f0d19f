/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A deterministic world of virtual mcus, links, host endpoints and tickers.
 *
 * Time is that of the earliest event; events of one time happen in a fixed
 * order.  An mcu runs ahead of the others, in one call, no further than the
 * time its first byte could take to reach the host, so that nothing the host
 * does in answer can lie in its past.  Within such a slice the order of two
 * mcus' events is not defined, but repeatable; slices shrink when a switch of
 * one mcu depends on the steps of another.
 *
 * One thread at a time.
 */
#ifndef VWORLD_H
#define VWORLD_H

#include "hostclock.h"
#include "vmcu.h"

struct vworld;

/* Why vworld_run() returned. */
enum vworld_event {
    VWORLD_LIMIT,               /* the limit is reached */
    VWORLD_HOST,                /* an endpoint has input for the host */
    VWORLD_TICKER,              /* a ticker is due: see vworld_get_ticker() */
    VWORLD_ERROR,               /* an mcu failed: see vworld_get_error() */
};

struct vworld_stats {
    uint64_t n_events, n_slices, n_runs;
};

struct vworld *vworld_new(uint64_t seed);
void vworld_free(struct vworld *w);
struct hostclock *vworld_get_clock(struct vworld *w);
double vworld_get_now(const struct vworld *w);
/* Random number of the world, to seed its parts from. */
uint64_t vworld_make_seed(struct vworld *w);

/* New mcu, owned by the world, or NULL with a text in
 * vworld_get_error(). */
struct vmcu *vworld_add_mcu(struct vworld *w, const struct vmcu_options *o);
/* Returns the ticker's number, or -1 when out of memory. */
int vworld_add_ticker(struct vworld *w, double period);
/* Something of the host's own: run(ctx, now) is called when the time has come
 * for which it was set, and returns the next.  -1 when out of memory. */
typedef double (*vworld_alarm_fn)(void *ctx, double now);
int vworld_add_alarm(struct vworld *w, vworld_alarm_fn run, void *ctx);
void vworld_set_alarm(struct vworld *w, int alarm, double wake);
/* Never call it again. */
void vworld_drop_alarm(struct vworld *w, int alarm);
/* Longest slice from now on (s). */
void vworld_limit_slice(struct vworld *w, double slice);

/* Let events happen until `limit` (s) or until the host is concerned. */
enum vworld_event vworld_run(struct vworld *w, double limit);
int vworld_get_ticker(const struct vworld *w);
const char *vworld_get_error(const struct vworld *w);
void vworld_get_stats(const struct vworld *w, struct vworld_stats *stats);
/* 0, or a negative number that says which invariant does not hold. */
int vworld_check(const struct vworld *w);

#endif
