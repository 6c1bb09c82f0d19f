/* SPDX-License-Identifier: GPL-3.0-or-later
 * Times of steps into messages.  See stepcompress.h. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "msgblock.h"
#include "stepbatch.h"
#include "stepcompress.h"
#include "stephist.h"

/* A step further than this (ticks) from the one before is sent by itself. */
#define FAR_TICKS (INT64_C(1) << 30)

struct stepcompress {
    uint32_t oid;
    struct stepcompress_options options;
    struct stepscale scale;
    int64_t made_clock;         /* no step comes before it any more */
    int64_t before_clock;       /* wanted clock of the step before `held` */
    int64_t held_clock;
    int8_t held_dir;            /* 0: none is held */
    int8_t run_dir;             /* of the windows in `fit` */
    int8_t sent_dir;            /* what the mcu was told; 0: nothing */
    int64_t position;           /* after the runs that became messages */
    int64_t pending;            /* steps in fit and held, signed */
    uint64_t n_steps, n_runs;
    struct qfifo out;
    struct qpool pool;
    struct stephist history;
    struct runfit fit;
};

struct stepcompress *
stepcompress_new(uint32_t oid)
{
    struct stepcompress *sc = calloc(1, sizeof(*sc));

    if (!sc)
        return NULL;
    if (stephist_init(&sc->history)) {
        free(sc);
        return NULL;
    }
    sc->oid = oid;
    runfit_reset(&sc->fit, 0);
    return sc;
}

void
stepcompress_delete(struct stepcompress *sc)
{
    if (!sc)
        return;
    qfifo_clear(&sc->out);
    qpool_clear(&sc->pool);
    stephist_free(&sc->history);
    free(sc);
}

void
stepcompress_configure(struct stepcompress *sc,
                       const struct stepcompress_options *options)
{
    if (!options->invert_dir != !sc->options.invert_dir)
        sc->sent_dir = 0;
    sc->options = *options;
}

void
stepcompress_set_time(struct stepcompress *sc, double offset, double freq)
{
    sc->scale = (struct stepscale) { offset, freq };
}

/* ---- Messages ---- */

static int
send_dir(struct stepcompress *sc, int dir, uint64_t req_clock)
{
    struct qmsg *m = qpool_new(&sc->pool);
    uint8_t *p;

    if (!m)
        return -ENOMEM;
    p = msgblock_put_int(m->data, sc->options.set_dir_tag);
    p = msgblock_put_int(p, sc->oid);
    p = msgblock_put_int(p, (dir > 0) != !!sc->options.invert_dir);
    m->len = (uint8_t)(p - m->data);
    m->req_clock = req_clock;
    qfifo_push(&sc->out, m);
    sc->sent_dir = (int8_t)dir;
    return 0;
}

static int
send_run(struct stepcompress *sc, const struct steprun *run, int dir)
{
    uint64_t first = (uint64_t)(run->start + run->interval);
    struct qmsg *m;
    uint8_t *p;

    if (dir != sc->sent_dir && send_dir(sc, dir, first))
        return -ENOMEM;
    m = qpool_new(&sc->pool);
    if (!m)
        return -ENOMEM;
    p = msgblock_put_int(m->data, sc->options.queue_step_tag);
    p = msgblock_put_int(p, sc->oid);
    p = msgblock_put_int(p, run->interval);
    p = msgblock_put_int(p, run->count);
    p = msgblock_put_int(p, (uint32_t)(int32_t)run->add);
    m->len = (uint8_t)(p - m->data);
    m->req_clock = first;
    m->min_clock = STEPMSG_CELL;
    qfifo_push(&sc->out, m);
    return 0;
}

static int
emit_run(struct stepcompress *sc, const struct steprun *run, int64_t first)
{
    int dir = sc->run_dir;
    struct stephistory entry = {
        .first_clock = first, .last_clock = run->end,
        .start_position = sc->position, .count = dir * run->count,
        .add = run->add, .interval = run->interval,
    };

    sc->position += entry.count;
    sc->pending -= entry.count;
    sc->n_runs++;
    sc->n_steps += run->count;
    if (stephist_add(&sc->history, &entry))
        return -ENOMEM;
    return send_run(sc, run, dir);
}

/* ---- Runs ---- */

/* Runs that are ready, so that there is room for another window. */
static int
emit_ready(struct stepcompress *sc)
{
    struct steprun run;
    int ret = 0;

    while (!ret && runfit_take(&sc->fit, &run))
        ret = emit_run(sc, &run, run.start + run.interval);
    return ret;
}

/* Runs that begin before `clock`. */
static int
emit_before(struct stepcompress *sc, int64_t clock)
{
    struct steprun run;
    int ret = 0;

    while (!ret && runfit_take_before(&sc->fit, clock, &run))
        ret = emit_run(sc, &run, run.start + run.interval);
    if (runfit_is_empty(&sc->fit) && sc->before_clock < sc->fit.start)
        sc->before_clock = sc->fit.start;
    return ret;
}

/* A step after a long rest; its interval is sent modulo 2^32. */
static int
emit_far(struct stepcompress *sc, int64_t clock)
{
    struct steprun run = { .count = 1 };

    clock -= (uint32_t)(clock - sc->fit.start) == 0;    /* 0 is no interval */
    run.interval = (uint32_t)(clock - sc->fit.start);
    run.start = clock - run.interval;
    run.end = clock;

    runfit_reset(&sc->fit, clock);
    return emit_run(sc, &run, clock);
}

/* How far a step may be off that has these neighbours. */
static inline uint32_t
get_error(const struct stepcompress *sc, int64_t before, int64_t after)
{
    int64_t room = ((before < after ? before : after) - 1) / 2;

    return room < sc->options.max_error ? (uint32_t)room
                                        : sc->options.max_error;
}

/* Hand the held step on; `after` is the time to the next one. */
static int
settle(struct stepcompress *sc, int64_t after)
{
    int64_t clock = sc->held_clock, before = clock - sc->before_clock;
    int is_far = before >= FAR_TICKS, ret = 0;

    if (sc->held_dir != sc->run_dir || is_far)
        ret = emit_before(sc, INT64_MAX);
    sc->run_dir = sc->held_dir;
    sc->before_clock = clock;
    sc->held_dir = 0;
    if (ret || is_far)
        return ret ? ret : emit_far(sc, clock);
    runfit_put(&sc->fit, (double)clock, get_error(sc, before, after));
    return runfit_is_full(&sc->fit) ? emit_ready(sc) : 0;
}

/* Is the held step undone by one at `clock` in direction dir? */
static int
is_cancelled(const struct stepcompress *sc, int64_t clock, int dir)
{
    return sc->held_dir == -dir
        && clock - sc->held_clock <= 2 * (int64_t)sc->options.max_error;
}

static int
push_step(struct stepcompress *sc, int64_t clock, int dir)
{
    int64_t newest = sc->held_dir ? sc->held_clock : sc->before_clock;
    int ret = 0;

    sc->pending += dir;
    if (is_cancelled(sc, clock, dir)) {
        sc->held_dir = 0;
        return 0;
    }
    if (clock <= newest)
        clock = newest + 1;
    if (sc->held_dir)
        ret = settle(sc, clock - sc->held_clock);
    sc->held_clock = clock;
    sc->held_dir = (int8_t)dir;
    return ret;
}

/* Many steps: at times of an array, or on a way. */
struct steps {
    const double *times;
    const struct stepway *way;
};

static double
get_clock(const struct stepcompress *sc, const struct steps *s, int64_t i)
{
    return s->way ? stepway_get_clock(s->way, &sc->scale, (double)i)
        : stepscale_get_clock(&sc->scale, s->times[i]);
}

/* Like push_step() of step `done` and as many of n more as there is room for,
 * if all are easy: a step in their direction is held, which is that of the run,
 * and none is far.  Returns how many were taken. */
static int
push_easy(struct stepcompress *sc, const struct steps *s, int64_t done,
          int64_t left, int dir)
{
    struct runfit *fit = &sc->fit;
    struct stepbatch b = {
        sc->scale, sc->options.max_error,
        (double)(sc->held_clock - sc->before_clock),
        fit->wanted + fit->end, fit->error + fit->end,
    };
    int n = RUNFIT_STORE - fit->end;

    if (sc->held_dir != dir || sc->run_dir != dir || !n)
        return 0;
    n = left < n ? (int)left : n;
    b.clocks[0] = (double)sc->held_clock;
    if (!(s->way ? stepbatch_set_way(&b, s->way, done, n)
          : stepbatch_set_times(&b, s->times + done, n))
        || !(b.clocks[n] - (double)sc->before_clock < FAR_TICKS))
        return 0;
    fit->end += n;
    sc->pending += n * dir;
    sc->before_clock = (int64_t)b.clocks[n - 1];
    sc->held_clock = (int64_t)b.clocks[n];
    return n;
}

static int
push_steps(struct stepcompress *sc, const struct steps *s, int64_t n, int dir)
{
    int64_t done = 0;
    int ret = 0;

    while (done < n && !ret) {
        int taken = push_easy(sc, s, done, n - done, dir);
        if (!taken) {
            ret = push_step(sc, (int64_t)get_clock(sc, s, done), dir);
            taken = 1;
        }
        if (!ret && runfit_is_full(&sc->fit))
            ret = emit_ready(sc);
        done += taken;
    }
    return ret;
}

int
stepcompress_push(struct stepcompress *sc, const double *times, int n,
                  int dir)
{
    const struct steps s = { .times = times };

    return push_steps(sc, &s, n, dir);
}

int
stepcompress_push_way(struct stepcompress *sc, const struct stepway *w,
                      int64_t n, int dir)
{
    const struct steps s = { .way = w };

    return push_steps(sc, &s, n, dir);
}

void
stepcompress_note_made(struct stepcompress *sc, double print_time)
{
    int64_t clock = (int64_t)((print_time - sc->scale.offset)
                              * sc->scale.freq);

    if (clock > sc->made_clock)
        sc->made_clock = clock;
}

/* The held step's successor is unknown, but not before made_clock. */
static int
settle_held(struct stepcompress *sc)
{
    int64_t gap = sc->made_clock - sc->held_clock;

    return sc->held_dir ? settle(sc, gap > 1 ? gap : 1) : 0;
}

int
stepcompress_flush(struct stepcompress *sc, int64_t clock)
{
    int ret = 0;

    if (sc->held_dir && sc->held_clock < clock)
        ret = settle_held(sc);
    return ret ? ret : emit_before(sc, clock);
}

static int
emit_all(struct stepcompress *sc)
{
    int ret = settle_held(sc);

    return ret ? ret : emit_before(sc, INT64_MAX);
}

int
stepcompress_reset(struct stepcompress *sc, int64_t clock)
{
    int ret = emit_all(sc);

    runfit_reset(&sc->fit, clock);
    sc->before_clock = clock;
    sc->run_dir = sc->sent_dir = 0;
    return ret;
}

int
stepcompress_add_message(struct stepcompress *sc, const uint8_t *data,
                         size_t len, uint64_t req_clock)
{
    int ret = emit_all(sc);
    struct qmsg *m;

    if (ret)
        return ret;
    m = qpool_new(&sc->pool);
    if (!m)
        return -ENOMEM;
    memcpy(m->data, data, len);
    m->len = (uint8_t)len;
    m->req_clock = req_clock ? req_clock : (uint64_t)sc->fit.start;
    m->min_clock = req_clock ? STEPMSG_CELL : 0;
    qfifo_push(&sc->out, m);
    return 0;
}

/* ---- Positions ---- */

int
stepcompress_set_last_position(struct stepcompress *sc, int64_t clock,
                               int64_t position)
{
    int ret = emit_all(sc);
    struct stephistory mark = {
        .first_clock = clock, .last_clock = clock, .start_position = position,
    };

    sc->position = position;
    return ret ? ret : stephist_add(&sc->history, &mark);
}

int64_t
stepcompress_get_last_position(const struct stepcompress *sc)
{
    return sc->position + sc->pending;
}

int64_t
stepcompress_find_position(const struct stepcompress *sc, int64_t clock)
{
    return stephist_find_position(&sc->history, clock, sc->position);
}

int
stepcompress_extract(const struct stepcompress *sc, struct stephistory *out,
                     int max, int64_t start, int64_t end)
{
    return stephist_extract(&sc->history, out, max, start, end);
}

void
stepcompress_forget(struct stepcompress *sc, int64_t clock)
{
    stephist_forget(&sc->history, clock);
}

struct qfifo *
stepcompress_get_out(struct stepcompress *sc)
{
    return &sc->out;
}

void
stepcompress_get_counts(const struct stepcompress *sc, uint64_t *n_steps,
                        uint64_t *n_runs)
{
    *n_steps = sc->n_steps;
    *n_runs = sc->n_runs;
}

int
stepcompress_check(const struct stepcompress *sc)
{
    const struct runfit *f = &sc->fit;
    int64_t windows = f->end - f->first + (f->n_tracks ? f->n_tracked : 0);

    if (sc->held_dir && sc->held_clock <= sc->before_clock)
        return -10;
    if (sc->pending != windows * sc->run_dir + sc->held_dir)
        return -11;
    if (stephist_check(&sc->history, sc->position))
        return -12;
    return runfit_check(f);
}
