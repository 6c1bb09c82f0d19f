/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Goes on with planned motion while the main thread does not.
 *
 * The main thread says up to where steps are made, where the plan may still
 * change (the way to rest behind it is laid down provisionally) and where it
 * ends, and until when it means to be back: that arms the guard.  If it is
 * not back by then, the guard makes and sends the steps in pieces, just in
 * time.  Coming back, the main thread disarms it and is told how far it got.
 *
 * Times are print_time (s), deadlines eventtime (s).
 * Threads: any; all work is done under the motionlock.
 */
#ifndef STEPGUARD_H
#define STEPGUARD_H

#include "hostclock.h"
#include "steppersync.h"

struct stepguard;

struct stepguard_plan {
    double reached;             /* steps are made up to here */
    double certain;             /* up to here nothing can change them */
    double end;                 /* here the machine rests */
    double deadline;            /* the first piece is made then */
    double slack;               /* s after which it is too late for that */
};

struct stepguard_result {
    double reached;             /* steps are made up to here now */
    int is_armed;               /* it was; else nothing has changed */
    int error;                  /* of steppersync_generate() or _flush() */
};

/* NULL when out of memory. */
struct stepguard *stepguard_new(struct hostclock *clock);
/* Ends its thread. */
void stepguard_free(struct stepguard *g);
/* Have a thread of its own call stepguard_run(); for real clocks only.
 * Returns 0 or a negative errno. */
int stepguard_start(struct stepguard *g);
/* Steps of this one are its business; it must live longer.  0 or -ENOMEM. */
int stepguard_add(struct stepguard *g, struct steppersync *ss);

void stepguard_arm(struct stepguard *g, const struct stepguard_plan *plan);
struct stepguard_result stepguard_disarm(struct stepguard *g);

/* Do what is due at `now`; returns when to call again (INFINITY: not). */
double stepguard_run(struct stepguard *g, double now);
/* 0, or a negative number that says which invariant does not hold. */
int stepguard_check(struct stepguard *g);

#endif
