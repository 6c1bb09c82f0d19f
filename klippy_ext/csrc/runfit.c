/* SPDX-License-Identifier: GPL-3.0-or-later
 * Long runs of steps.  See runfit.h. */
#include <math.h>
#include <string.h>

#include "pair.h"
#include "runfit.h"

enum { PROBES = 4 };

/* A run is stretched beyond its best length if that gives this much more. */
#define STRETCH 1.35

enum {
    /* A longer run than this is not worth the search for the longest. */
    SHORT = 256,
    /* Where the last run was no longer than LAST_TINY, one of up to TINY steps
     * is taken as long as possible: it hardly ever pays to end it early. */
    LAST_TINY = 16, TINY = 24,
};

void
runfit_reset(struct runfit *f, int64_t start)
{
    f->start = start;
    f->first = f->end = f->n_tracks = 0;
    f->last_count = 8;
}

/* ---- Trying one length ---- */

static inline struct runview
get_view(const struct runfit *f)
{
    return (struct runview) {
        f->wanted + f->first, f->error + f->first, (double)f->start,
    };
}

static inline int
is_met(const struct runview *v, int64_t k, double clock)
{
    return fabs(clock - runview_get(v, k)) <= v->error[k - 1];
}

/* The curve through the start, the middle and step n.  Returns 0 if its add
 * is too large for a message. */
static int
draw_curve(const struct runview *v, int64_t n, struct runcurve *c)
{
    int64_t middle = n / 2;
    double end = runview_get(v, n) / (double)n, add;

    *c = (struct runcurve) { runview_get(v, 1), 0. };
    if (n == 1)
        return 1;
    add = 2. * (end - runview_get(v, middle) / (double)middle)
        / (double)(n - middle);
    if (!(fabs(add) < RUNCURVE_ADD_MAX))
        return 0;
    c->add = pair_round_one(add);
    c->interval = pair_round_one(end - .5 * c->add * (double)(n - 1));
    return 1;
}

/* Does a run of n steps seem possible?  The steps that are probed are where a
 * smooth path is furthest from the curve. */
static int
probe(const struct runview *v, int64_t n, struct runcurve *c)
{
    const int64_t steps[PROBES] = {
        n, (n * 13 + 32) / 64 + !n, (n * 51 + 32) / 64, (n + 1) / 2,
    };

    if (!draw_curve(v, n, c))
        return 0;
    for (int i = 0; i < PROBES; i++)
        if (steps[i] && !is_met(v, steps[i],
                                runcurve_get(c, (double)steps[i])))
            return 0;
    return 1;
}

/* ---- Searching the length ---- */

static int64_t
grow(int64_t n, int64_t limit)
{
    int64_t more = n + n / 4 + 1;

    return more < limit ? more : limit;
}

/* The greatest length, about, that probe() accepts; 1 always does. */
static int64_t
search_length(const struct runfit *f, int64_t limit)
{
    int64_t good = f->last_count < limit ? f->last_count : limit, bad;
    const struct runview v = get_view(f);
    struct runcurve c;

    if (probe(&v, good, &c)) {
        for (bad = grow(good, limit); bad > good && probe(&v, bad, &c);
             bad = grow(good, limit))
            good = bad;
        if (good == limit)
            return good;
    } else {
        do {
            bad = good;
            good -= good / 4 + 1;
        } while (good > 1 && !probe(&v, good, &c));
        good = good > 1 ? good : 1;
    }
    while (bad - good > 1 + good / 32) {
        int64_t n = (good + bad) / 2;
        if (probe(&v, n, &c))
            good = n;
        else
            bad = n;
    }
    return good;
}

/* ---- Choosing the length ---- */

/* The longest of the next runs, about, and its curve; with an add close to
 * this. */
static int64_t
find_longest(struct runfit *f, int64_t limit, double add, struct runcurve *c)
{
    int n = limit < RUNLINE_MAX ? (int)limit : RUNLINE_MAX;

    n = runline_find_longest(&f->line, n, add, c);
    if (n)
        return n;
    *c = (struct runcurve) { runview_get(&f->line.view, 1), 0. };
    return 1;
}

/* How far a run of n steps and the one after it get, about. */
static int64_t
look_ahead(struct runfit *f, int64_t n, const struct runcurve *c)
{
    int64_t limit = f->end - f->first - n, more, start = f->start;

    if (limit <= 0)
        return n;
    f->first += (int)n;
    f->start += (int64_t)runcurve_get(c, (double)n);
    more = search_length(f, limit);
    f->start = start;
    f->first -= (int)n;
    return n + more;
}

/* Of the drawn and the longest run the one after which the next gets further. */
static int64_t
compare_lengths(struct runfit *f, struct runcurve *c)
{
    int64_t limit = f->end - f->first, n = search_length(f, limit), met, most;
    const struct runview v = get_view(f);
    struct runcurve longest;

    while (!probe(&v, n, c)
           || (met = runcurve_count_met(c, &v, 0, limit)) < n)
        n -= n / 16 + 1;
    if ((double)met > STRETCH * (double)n || n == limit)
        return met;
    if (n > SHORT)
        return n;
    most = find_longest(f, limit, c->add, &longest);
    if (most <= n || (n > LAST_TINY
                      && look_ahead(f, n, c) >= look_ahead(f, most, &longest)))
        return n;
    *c = longest;
    return most;
}

/* The length of the next run and its curve, every step checked. */
static int64_t
choose_length(struct runfit *f, struct runcurve *c)
{
    const struct runview v = get_view(f);

    runline_init(&f->line, &v);
    if (f->last_count <= LAST_TINY) {
        int64_t limit = f->end - f->first, most = f->last_count;
        double add = draw_curve(&v, most < limit ? most : limit, c) ? c->add
                                                                    : 0.;
        most = find_longest(f, limit, add, c);
        if (most <= TINY)
            return most;
    }
    return compare_lengths(f, c);
}

/* ---- Bytes ---- */

/* The closest add that takes a byte less on the wire; itself where none. */
static double
shorten_add(double add)
{
    if (add < -4096.)
        return -4096.;
    if (add < -32.)
        return -32.;
    if (add > 12287.)
        return 12287.;
    return add > 95. ? 95. : add;
}

/* Bend the curve of a short run so that its add takes fewer bytes, if it then
 * still meets all n windows. */
static void
save_bytes(struct runfit *f, int64_t n, struct runcurve *c)
{
    double add = c->add, least, most;

    if (n < 2 || n > SHORT)
        return;
    for (;;) {
        struct runcurve bent;
        double shorter = shorten_add(add);
        if (shorter == add)
            return;
        add = shorter;
        if (runline_find_intervals(&f->line, add, (int)n, &least, &most) < n)
            return;
        runline_aim(&f->line, (int)n, add, least, most, &bent);
        if (runcurve_count_met(&bent, &f->line.view, 0, n) < n)
            return;
        *c = bent;
    }
}

static void
drop_windows(struct runfit *f, int64_t n)
{
    f->first += (int)n;
    if (f->first == f->end)
        f->first = f->end = 0;
}

/* All stored windows fit one run, with the curve c: track it from now on. */
static void
start_tracks(struct runfit *f, const struct runcurve *c)
{
    const struct runview v = get_view(f);
    int64_t n = f->end - f->first;

    f->n_tracks = 0;
    for (int i = -1; i <= 1; i++) {
        struct runtrack t;
        runtrack_init(&t, c->add + i);
        if (runtrack_run(&t, &v, 0, n) == n)
            f->tracks[f->n_tracks++] = t;
    }
    f->tracked_mid = f->wanted[f->end - 1];
    f->n_tracked = n;
    drop_windows(f, n);
}

/* Go on with the tracks that last longest.  Returns 0 if the run is over. */
static int
extend_tracks(struct runfit *f)
{
    const struct runview v = get_view(f);
    int64_t stored = f->end - f->first, limit, best = 0;
    struct runtrack met[RUNFIT_TRACKS];
    int n = 0;

    limit = RUNFIT_COUNT_MAX - f->n_tracked;
    limit = limit < stored ? limit : stored;
    for (int i = 0; i < f->n_tracks; i++) {
        struct runtrack t = f->tracks[i];
        int64_t count = runtrack_run(&t, &v, f->n_tracked, limit);
        n = count > best ? 0 : n;
        if (count < best)
            continue;
        best = count;
        met[n++] = t;
    }
    memcpy(f->tracks, met, (size_t)n * sizeof(*met));
    f->n_tracks = n;
    f->n_tracked += best;
    if (best)
        f->tracked_mid = f->wanted[f->first + best - 1];
    drop_windows(f, best);
    return best == stored;
}

/* The earliest clock, from the start, of the tracked run's first step. */
static int64_t
get_first(const struct runfit *f)
{
    double first = f->tracks[0].interval_lo;

    for (int i = 1; i < f->n_tracks; i++)
        first = fmin(first, f->tracks[i].interval_lo);
    return (int64_t)first;
}

/* ---- Giving out ---- */

static void
finish_curve(struct runfit *f, const struct runcurve *c, int64_t n,
             struct steprun *run)
{
    *run = (struct steprun) {
        .start = f->start,
        .end = f->start + (int64_t)runcurve_get(c, (double)n),
        .interval = (uint32_t)c->interval, .count = (uint16_t)n,
        .add = (int16_t)c->add,
    };
    f->start = run->end;
}

/* The track and interval that end closest to the middle of the last window. */
static void
finish_tracks(struct runfit *f, struct steprun *run)
{
    double wanted = f->tracked_mid - (double)f->start, best = INFINITY;
    struct runcurve chosen = { 0., 0. };

    for (int i = 0; i < f->n_tracks; i++) {
        struct runcurve c;
        double miss = runtrack_aim(&f->tracks[i], (double)f->n_tracked,
                                   wanted, &c);
        if (miss < best) {
            best = miss;
            chosen = c;
        }
    }
    finish_curve(f, &chosen, f->n_tracked, run);
    f->n_tracks = 0;
}

/* Give out a run of stored windows. */
static void
finish_stored(struct runfit *f, struct runcurve *c, int64_t n,
              struct steprun *run)
{
    save_bytes(f, n, c);
    finish_curve(f, c, n, run);
    f->last_count = (int)n;
    drop_windows(f, n);
}

/* Make room at the end. */
static void
compact(struct runfit *f)
{
    size_t n = (size_t)(f->end - f->first);

    memmove(f->wanted, f->wanted + f->first, n * sizeof(*f->wanted));
    memmove(f->error, f->error + f->first, n * sizeof(*f->error));
    f->first = 0;
    f->end = (int)n;
}

int
runfit_take(struct runfit *f, struct steprun *run)
{
    struct runcurve c;
    int64_t n;

    if (f->n_tracks) {
        if (extend_tracks(f))
            return 0;
        finish_tracks(f, run);
        return 1;
    }
    if (f->end - f->first < RUNFIT_AHEAD) {
        compact(f);
        return 0;
    }
    n = choose_length(f, &c);
    if (n == f->end - f->first) {
        start_tracks(f, &c);
        return 0;
    }
    finish_stored(f, &c, n, run);
    return 1;
}

int
runfit_take_before(struct runfit *f, int64_t limit, struct steprun *run)
{
    struct runcurve c;
    int64_t n;

    if (f->n_tracks) {
        if (f->start + get_first(f) >= limit)
            return 0;
        extend_tracks(f);
        finish_tracks(f, run);
        return 1;
    }
    if (f->first == f->end || f->wanted[f->first] >= (double)limit)
        return 0;
    n = choose_length(f, &c);
    finish_stored(f, &c, n, run);
    return 1;
}

int
runfit_check(const struct runfit *f)
{
    if (f->first < 0 || f->first > f->end || f->end > RUNFIT_STORE)
        return -1;
    for (int i = 0; i < f->n_tracks; i++)
        if (runtrack_check(&f->tracks[i]))
            return runtrack_check(&f->tracks[i]);
    for (int i = f->first + 1; i < f->end; i++)
        if (f->wanted[i] - f->error[i]
            <= f->wanted[i - 1] + f->error[i - 1])
            return -3;
    return runline_check(&f->line);
}
