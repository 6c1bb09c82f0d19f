/* SPDX-License-Identifier: GPL-3.0-or-later
 * The events of a virtual world and their order.  See vworld.h. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "vrandom.h"
#include "vworld.h"

/* Shortest slice: what cables without delay are taken to need (s). */
#define SLICE_MIN 20e-6

struct ticker {
    double period, start;
    uint64_t count;             /* of calls so far */
};

struct alarm {
    vworld_alarm_fn run;        /* NULL: not in use */
    void *ctx;
    double wake;
};

struct vworld {
    struct hostclock clock;     /* first: see read_world() */
    double now;
    uint64_t seed;
    struct vmcu **mcus;
    int n_mcus;
    struct ticker *tickers;
    int n_tickers, due_ticker;
    struct alarm *alarms;
    int n_alarms;
    double slice;
    struct vworld_stats stats;
    char error[256];
};

/* What happens next, and to whom. */
enum kind { NOTHING, TO_MCU, FROM_MCU, HOST_WAKE, ALARM, TICK };
struct event {
    double time;
    enum kind kind;
    int index;
};

static double
read_world(const struct hostclock *hc)
{
    return ((const struct vworld *)hc)->now;
}

struct vworld *
vworld_new(uint64_t seed)
{
    struct vworld *w = calloc(1, sizeof(*w));

    if (!w)
        return NULL;
    w->clock.read = read_world;
    w->seed = seed;
    w->slice = INFINITY;
    return w;
}

void
vworld_free(struct vworld *w)
{
    if (!w)
        return;
    for (int i = 0; i < w->n_mcus; i++) {
        vmcu_close(w->mcus[i]);
        free(w->mcus[i]);
    }
    free(w->mcus);
    free(w->tickers);
    free(w->alarms);
    free(w);
}

struct hostclock *
vworld_get_clock(struct vworld *w)
{
    return &w->clock;
}

double
vworld_get_now(const struct vworld *w)
{
    return w->now;
}

uint64_t
vworld_make_seed(struct vworld *w)
{
    return vrandom_next(&w->seed);
}

static void *
grow(void *array, int count, size_t size)
{
    return realloc(array, ((size_t)count + 1) * size);
}

struct vmcu *
vworld_add_mcu(struct vworld *w, const struct vmcu_options *o)
{
    struct vmcu *m = malloc(sizeof(*m));
    struct vmcu **mcus = grow(w->mcus, w->n_mcus, sizeof(*mcus));

    if (mcus)
        w->mcus = mcus;
    if (!m || !mcus) {
        snprintf(w->error, sizeof(w->error), "out of memory");
        free(m);
        return NULL;
    }
    if (vmcu_open(m, o, &w->now)) {
        memcpy(w->error, m->error, sizeof(w->error));
        vmcu_close(m);
        free(m);
        return NULL;
    }
    w->mcus[w->n_mcus++] = m;
    vworld_limit_slice(w, m->link.byte_time + m->link.latency);
    return m;
}

int
vworld_add_ticker(struct vworld *w, double period)
{
    struct ticker *tickers = grow(w->tickers, w->n_tickers,
                                  sizeof(*tickers));

    if (!tickers)
        return -1;
    w->tickers = tickers;
    tickers[w->n_tickers] = (struct ticker) {
        .period = period, .start = w->now,
    };
    return w->n_tickers++;
}

int
vworld_add_alarm(struct vworld *w, vworld_alarm_fn run, void *ctx)
{
    struct alarm *alarms, new = { run, ctx, INFINITY };

    for (int i = 0; i < w->n_alarms; i++)
        if (!w->alarms[i].run) {
            w->alarms[i] = new;
            return i;
        }
    alarms = grow(w->alarms, w->n_alarms, sizeof(*alarms));
    if (!alarms)
        return -1;
    w->alarms = alarms;
    alarms[w->n_alarms] = new;
    return w->n_alarms++;
}

void
vworld_set_alarm(struct vworld *w, int alarm, double wake)
{
    w->alarms[alarm].wake = wake;
}

void
vworld_drop_alarm(struct vworld *w, int alarm)
{
    w->alarms[alarm] = (struct alarm) { NULL, NULL, INFINITY };
}

void
vworld_limit_slice(struct vworld *w, double slice)
{
    w->slice = fmax(fmin(w->slice, slice), SLICE_MIN);
}

static void
consider(struct event *e, double time, enum kind kind, int index)
{
    if (time < e->time)
        *e = (struct event) { time, kind, index };
}

static struct event
find_event(const struct vworld *w)
{
    struct event e = { INFINITY, NOTHING, 0 };

    for (int i = 0; i < w->n_mcus; i++) {
        const struct vlink *l = &w->mcus[i]->link;
        consider(&e, vlink_get_arrival(l, VLINK_TO_MCU), TO_MCU, i);
        consider(&e, vlink_get_arrival(l, VLINK_FROM_MCU), FROM_MCU, i);
        consider(&e, l->wake, HOST_WAKE, i);
    }
    for (int i = 0; i < w->n_alarms; i++)
        consider(&e, w->alarms[i].wake, ALARM, i);
    for (int i = 0; i < w->n_tickers; i++) {
        const struct ticker *t = &w->tickers[i];
        double time = t->start + (double)(t->count + 1) * t->period;
        consider(&e, time, TICK, i);
    }
    return e;
}

static double
find_mcu_event(const struct vworld *w)
{
    double time = INFINITY;

    for (int i = 0; i < w->n_mcus; i++)
        time = fmin(time, w->mcus[i]->next_time);
    return time;
}

static enum vworld_event
note_failure(struct vworld *w, const struct vmcu *m)
{
    memcpy(w->error, m->error, sizeof(w->error));
    return VWORLD_ERROR;
}

/* Run all mcus that have something to do until `time`. */
static enum vworld_event
run_slice(struct vworld *w, double time)
{
    w->stats.n_slices++;
    for (int i = 0; i < w->n_mcus; i++) {
        struct vmcu *m = w->mcus[i];
        if (m->next_time > time)
            continue;
        w->stats.n_runs++;
        if (vmcu_run(m, time))
            return note_failure(w, m);
    }
    return VWORLD_LIMIT;
}

static enum vworld_event
deliver_to_mcu(struct vworld *w, struct vmcu *m)
{
    struct vchunk *chunk = vlink_take(&m->link, VLINK_TO_MCU);
    int ret = vmcu_receive(m, w->now, chunk->data, chunk->len);

    free(chunk);
    return ret ? note_failure(w, m) : VWORLD_LIMIT;
}

static enum vworld_event
deliver_to_host(struct vworld *w, struct vlink *l)
{
    struct vchunk *chunk = vlink_take(l, VLINK_FROM_MCU);
    int has_input = 0;

    if (l->has_host) {
        has_input = l->host.receive(l->host.ctx, w->now, chunk->data,
                                    chunk->len);
        vlink_wake(l);
    }
    free(chunk);
    return has_input ? VWORLD_HOST : VWORLD_LIMIT;
}

static enum vworld_event
run_host(struct vworld *w, struct vlink *l)
{
    double wake;

    l->wake = INFINITY;
    wake = l->host.run(l->host.ctx, w->now);
    l->wake = fmin(l->wake, wake);
    return VWORLD_LIMIT;
}

static enum vworld_event
run_alarm(struct vworld *w, struct alarm *alarm)
{
    alarm->wake = INFINITY;
    alarm->wake = alarm->run(alarm->ctx, w->now);
    return VWORLD_LIMIT;
}

static enum vworld_event
handle_event(struct vworld *w, const struct event *e)
{
    if (e->time > w->now)
        w->now = e->time;
    w->stats.n_events++;
    switch (e->kind) {
    case TO_MCU:
        return deliver_to_mcu(w, w->mcus[e->index]);
    case FROM_MCU:
        return deliver_to_host(w, &w->mcus[e->index]->link);
    case HOST_WAKE:
        return run_host(w, &w->mcus[e->index]->link);
    case ALARM:
        return run_alarm(w, &w->alarms[e->index]);
    case TICK:
        w->tickers[e->index].count++;
        w->due_ticker = e->index;
        return VWORLD_TICKER;
    case NOTHING:
        break;
    }
    return VWORLD_LIMIT;
}

enum vworld_event
vworld_run(struct vworld *w, double limit)
{
    enum vworld_event ret;

    for (;;) {
        struct event e = find_event(w);
        double mcu_time = find_mcu_event(w);
        if (fmin(e.time, mcu_time) > limit)
            break;
        if (mcu_time <= e.time)
            ret = run_slice(w, fmin(fmin(e.time, limit),
                                    mcu_time + w->slice));
        else
            ret = handle_event(w, &e);
        if (ret != VWORLD_LIMIT)
            return ret;
    }
    if (limit > w->now && limit < INFINITY)
        w->now = limit;
    return VWORLD_LIMIT;
}

int
vworld_get_ticker(const struct vworld *w)
{
    return w->due_ticker;
}

const char *
vworld_get_error(const struct vworld *w)
{
    return w->error;
}

void
vworld_get_stats(const struct vworld *w, struct vworld_stats *stats)
{
    *stats = w->stats;
}

int
vworld_check(const struct vworld *w)
{
    int ret = hostclock_check(&w->clock);

    if (ret || w->n_mcus < 0 || !(w->now >= 0.) || !(w->slice > 0.))
        return ret ? ret : -93;
    for (int i = 0; i < w->n_tickers; i++)
        if (!(w->tickers[i].period > 0.)
            || !(w->tickers[i].start <= w->now))
            return -94;
    for (int i = 0; i < w->n_alarms; i++)
        if (!w->alarms[i].run && w->alarms[i].wake != INFINITY)
            return -95;
    for (int i = 0; i < w->n_mcus && !ret; i++)
        ret = vmcu_check(w->mcus[i]);
    return ret;
}
