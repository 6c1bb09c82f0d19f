/* SPDX-License-Identifier: GPL-3.0-or-later
 * Planned motion without the main thread.  See stepguard.h. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>

#include "motionlock.h"
#include "realtime.h"
#include "stepguard.h"

/* Steps are made in pieces of so long (s) */
#define PIECE_TIME .25

pthread_mutex_t motionlock = PTHREAD_MUTEX_INITIALIZER;

struct stepguard {
    struct hostclock *clock;
    struct steppersync **syncs;
    int n_syncs;
    struct stepguard_plan plan;
    int is_armed, error;
    /* Of the thread */
    pthread_t thread;
    pthread_cond_t changed;
    double wake;                /* what it waits for */
    int has_thread, is_ending;
};

struct stepguard *
stepguard_new(struct hostclock *clock)
{
    struct stepguard *g = calloc(1, sizeof(*g));
    pthread_condattr_t attr;

    if (!g)
        return NULL;
    g->clock = clock;
    pthread_condattr_init(&attr);
    pthread_condattr_setclock(&attr, CLOCK_MONOTONIC);
    pthread_cond_init(&g->changed, &attr);
    pthread_condattr_destroy(&attr);
    return g;
}

int
stepguard_add(struct stepguard *g, struct steppersync *ss)
{
    struct steppersync **grown;
    int ret = -ENOMEM;

    motionlock_take();
    grown = realloc(g->syncs, (size_t)(g->n_syncs + 1) * sizeof(*grown));
    if (grown) {
        g->syncs = grown;
        grown[g->n_syncs++] = ss;
        ret = 0;
    }
    motionlock_give();
    return ret;
}

/* ---- Pieces ---- */

static int
make_steps(struct stepguard *g, double until)
{
    for (int i = 0; i < g->n_syncs; i++) {
        int ret = steppersync_generate(g->syncs[i], until);
        if (!ret)
            ret = steppersync_flush_until(g->syncs[i], until);
        if (ret)
            return ret;
    }
    return 0;
}

/* A piece does not reach into what may change together with what may not. */
static double
find_piece_end(const struct stepguard_plan *p)
{
    double until = fmin(p->reached + PIECE_TIME, p->end);

    return p->reached < p->certain ? fmin(until, p->certain) : until;
}

/* Returns when to come again; the lock is held. */
static double
do_due(struct stepguard *g, double now)
{
    struct stepguard_plan *p = &g->plan;
    double until;

    while (g->is_armed && p->reached < p->end && now >= p->deadline) {
        if (now > p->deadline + p->slack)
            return INFINITY;    /* this thread was away as well */
        until = find_piece_end(p);
        g->error = make_steps(g, until);
        if (g->error)
            return INFINITY;
        p->deadline += until - p->reached;
        p->reached = until;
    }
    return g->is_armed && p->reached < p->end ? p->deadline : INFINITY;
}

double
stepguard_run(struct stepguard *g, double now)
{
    double wake;

    motionlock_take();
    wake = do_due(g, now);
    motionlock_give();
    return wake;
}

int
stepguard_check(struct stepguard *g)
{
    const struct stepguard_plan *p = &g->plan;
    int ret = 0;

    motionlock_take();
    if (g->n_syncs < 0 || (g->n_syncs > 0 && !g->syncs))
        ret = -1;
    else if (g->is_armed
             && !(p->reached <= p->end && p->slack >= 0.))
        ret = -2;               /* never past the place of rest */
    else if (g->error > 0)
        ret = -3;
    motionlock_give();
    return ret;
}

/* ---- The main thread's side ---- */

void
stepguard_arm(struct stepguard *g, const struct stepguard_plan *plan)
{
    motionlock_take();
    g->plan = *plan;
    g->is_armed = 1;
    g->error = 0;
    if (g->has_thread && plan->deadline < g->wake)
        pthread_cond_signal(&g->changed);
    motionlock_give();
}

struct stepguard_result
stepguard_disarm(struct stepguard *g)
{
    struct stepguard_result result;

    motionlock_take();
    result = (struct stepguard_result) {
        .reached = g->plan.reached, .is_armed = g->is_armed,
        .error = g->error,
    };
    g->is_armed = 0;
    motionlock_give();
    return result;
}

/* ---- The thread ---- */

static void
wait_until(struct stepguard *g, double wake)
{
    struct timespec ts;

    g->wake = wake;
    if (wake == INFINITY) {
        pthread_cond_wait(&g->changed, &motionlock);
        return;
    }
    ts.tv_sec = (time_t)wake;
    ts.tv_nsec = (long)((wake - floor(wake)) * 1e9);
    pthread_cond_timedwait(&g->changed, &motionlock, &ts);
}

static void *
run_thread(void *arg)
{
    struct stepguard *g = arg;

    realtime_raise_thread();
    motionlock_take();
    while (!g->is_ending)
        wait_until(g, do_due(g, hostclock_now(g->clock)));
    motionlock_give();
    return NULL;
}

int
stepguard_start(struct stepguard *g)
{
    int error;

    if (g->has_thread)
        return 0;
    g->wake = INFINITY;
    error = pthread_create(&g->thread, NULL, run_thread, g);
    g->has_thread = !error;
    return -error;
}

void
stepguard_free(struct stepguard *g)
{
    if (!g)
        return;
    if (g->has_thread) {
        motionlock_take();
        g->is_ending = 1;
        pthread_cond_signal(&g->changed);
        motionlock_give();
        pthread_join(g->thread, NULL);
    }
    pthread_cond_destroy(&g->changed);
    free(g->syncs);
    free(g);
}
