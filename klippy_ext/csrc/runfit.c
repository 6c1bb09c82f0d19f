/* SPDX-License-Identifier: GPL-3.0-or-later
 * Long runs of steps.  See runfit.h. */
#include <math.h>
#include <string.h>

#include "runfit.h"
#include "runline.h"

enum { PROBES = 4 };

/* The tracks beside it must fit a message, too. */
#define ADD_MAX 32766.

/* A run is stretched beyond its best length if that gives this much more. */
#define STRETCH 1.25

/* A longer run than this is not worth the search for the longest. */
enum { SHORT = 192 };

void
runfit_reset(struct runfit *f, int64_t start)
{
    f->start = start;
    f->first = f->end = f->n_tracks = 0;
    f->last_count = 8;
}

/* ---- Trying one length ---- */

struct curve {
    int64_t interval, add;
};

static inline int64_t
get_clock(const struct curve *c, int64_t k)
{
    return c->interval * k + c->add * (k * (k - 1) / 2);
}

/* Wanted clock of step k = 1, 2, ... of the next run, from its start. */
static inline int64_t
get_wanted(const struct runfit *f, int64_t k)
{
    return f->wanted[f->first + k - 1] - f->start;
}

static inline int
is_met(const struct runfit *f, int64_t k, int64_t clock)
{
    int64_t error = f->error[f->first + k - 1];

    return (uint64_t)(clock - get_wanted(f, k) + error)
        <= (uint64_t)(2 * error);
}

/* The curve through the start, the middle and step n.  Returns 0 if its add
 * is too large for a message. */
static int
draw_curve(const struct runfit *f, int64_t n, struct curve *c)
{
    int64_t middle = n / 2;
    double end = (double)get_wanted(f, n) / (double)n, add, rest;

    *c = (struct curve) { get_wanted(f, 1), 0 };
    if (n == 1)
        return 1;
    add = 2. * (end - (double)get_wanted(f, middle) / (double)middle)
        / (double)(n - middle);
    if (!(fabs(add) < ADD_MAX))
        return 0;
    c->add = (int64_t)floor(add + .5);
    rest = end - .5 * (double)(c->add * (n - 1));
    c->interval = (int64_t)floor(rest + .5);
    return 1;
}

/* How many of the next n windows the curve meets before it misses one. */
static int64_t
count_met(const struct runfit *f, const struct curve *c, int64_t n)
{
    const int64_t *wanted = &f->wanted[f->first];
    const uint32_t *error = &f->error[f->first];
    int64_t clock = f->start, ahead = c->interval;

    for (int64_t k = 0; k < n; k++) {
        clock += ahead;
        ahead += c->add;
        if ((uint64_t)(clock - wanted[k] + error[k]) > 2 * (uint64_t)error[k])
            return k;
    }
    return n;
}

/* Does a run of n steps seem possible?  The steps that are probed are where a
 * smooth path is furthest from the curve. */
static int
probe(const struct runfit *f, int64_t n, struct curve *c)
{
    const int64_t steps[PROBES] = {
        n, (n * 13 + 32) / 64 + !n, (n * 51 + 32) / 64, (n + 1) / 2,
    };

    if (!draw_curve(f, n, c))
        return 0;
    for (int i = 0; i < PROBES; i++)
        if (steps[i] && !is_met(f, steps[i], get_clock(c, steps[i])))
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
    struct curve c;

    if (probe(f, good, &c)) {
        for (bad = grow(good, limit); bad > good && probe(f, bad, &c);
             bad = grow(good, limit))
            good = bad;
        if (good == limit)
            return good;
    } else {
        do {
            bad = good;
            good -= good / 4 + 1;
        } while (good > 1 && !probe(f, good, &c));
        good = good > 1 ? good : 1;
    }
    while (bad - good > 1 + good / 32) {
        int64_t n = (good + bad) / 2;
        if (probe(f, n, &c))
            good = n;
        else
            bad = n;
    }
    return good;
}

/* ---- Tracks: one add, all intervals ---- */

static int64_t
div_up(int64_t a, int64_t b)
{
    return (a + b - 1) / b;
}

/* Let the track meet window number k (1, 2, ...).  Returns 0 if it cannot. */
static int
track_bend(struct runfit_track *t, int64_t k, int64_t lo, int64_t hi)
{
    if (t->clock_lo < lo) {
        int64_t more = div_up(lo - t->clock_lo, k);
        t->interval_lo += more;
        t->ahead_lo += more;
        t->clock_lo += more * k;
    }
    if (t->clock_hi > hi) {
        int64_t less = div_up(t->clock_hi - hi, k);
        t->interval_hi -= less;
        t->ahead_hi -= less;
        t->clock_hi -= less * k;
    }
    return t->interval_lo <= t->interval_hi;
}

static inline int
track_extend(struct runfit_track *t, int64_t k, int64_t lo, int64_t hi)
{
    t->clock_lo += t->ahead_lo;
    t->clock_hi += t->ahead_hi;
    t->ahead_lo += t->add;
    t->ahead_hi += t->add;
    return (t->clock_lo >= lo && t->clock_hi <= hi)
        || track_bend(t, k, lo, hi);
}

/* Let a track meet stored windows, as steps `from`, `from` + 1, ... of the
 * run; at most n.  Returns how many it meets; it is then as after those. */
static int64_t
track_run(const struct runfit *f, struct runfit_track *t, int64_t from,
          int64_t n)
{
    for (int64_t i = 0; i < n; i++) {
        int64_t wanted = f->wanted[f->first + i] - f->start;
        int64_t error = f->error[f->first + i];
        struct runfit_track before = *t;
        if (!track_extend(t, from + i, wanted - error, wanted + error)) {
            *t = before;
            return i;
        }
    }
    return n;
}

static void
track_init(struct runfit_track *t, int64_t add)
{
    *t = (struct runfit_track) {
        .add = add, .interval_lo = 1, .interval_hi = UINT32_MAX,
        .ahead_lo = 1, .ahead_hi = UINT32_MAX,
    };
}

/* The interval of the track that brings step k closest to its wanted clock.
 * Returns by how much that is missed. */
static int64_t
track_aim(const struct runfit_track *t, int64_t k, int64_t wanted,
          struct curve *c)
{
    int64_t miss;

    *c = (struct curve) { 0, t->add };
    wanted -= get_clock(c, k);
    c->interval = (wanted + k / 2) / k;
    if (c->interval < t->interval_lo)
        c->interval = t->interval_lo;
    if (c->interval > t->interval_hi)
        c->interval = t->interval_hi;
    miss = c->interval * k - wanted;
    return miss < 0 ? -miss : miss;
}

/* ---- Choosing the length ---- */

/* The longest of the next runs, about, and its curve; 0 if there is none. */
static int64_t
find_longest(const struct runfit *f, int64_t limit, struct curve *c)
{
    int64_t best = 0, add;
    double slope;
    int n = limit < RUNLINE_MAX ? (int)limit : RUNLINE_MAX;

    n = runline_aim(&f->wanted[f->first], &f->error[f->first], f->start, n,
                    &slope);
    /* no more than a message can say: windows may leave room for that */
    slope = fmax(-ADD_MAX / 2., fmin(slope, ADD_MAX / 2. - 1.));
    add = (int64_t)floor(2. * slope);
    for (int i = 0; i < 2; i++) {
        struct runfit_track t;
        int64_t count;
        track_init(&t, add + i);
        count = track_run(f, &t, 1, n);
        if (count <= best)
            continue;
        best = count;
        track_aim(&t, count, get_wanted(f, count), c);
    }
    return best;
}

/* How far a run of n steps and the one after it get, about. */
static int64_t
look_ahead(struct runfit *f, int64_t n, const struct curve *c)
{
    int64_t limit = f->end - f->first - n, more;

    if (limit <= 0)
        return n;
    f->first += (int)n;
    f->start += get_clock(c, n);
    more = search_length(f, limit);
    f->start -= get_clock(c, n);
    f->first -= (int)n;
    return n + more;
}

/* The length of the next run and its curve, every step checked. */
static int64_t
choose_length(struct runfit *f, struct curve *c)
{
    int64_t limit = f->end - f->first, n = search_length(f, limit), met, most;
    struct curve longest;

    while (!probe(f, n, c) || (met = count_met(f, c, limit)) < n)
        n -= n / 16 + 1;
    if ((double)met > STRETCH * (double)n || n == limit)
        return met;
    if (n > SHORT)
        return n;
    most = find_longest(f, limit, &longest);
    if (most <= n || look_ahead(f, n, c) >= look_ahead(f, most, &longest))
        return n;
    *c = longest;
    return most;
}

/* ---- Bytes ---- */

/* The closest add that takes a byte less on the wire; itself where none. */
static int64_t
shorten_add(int64_t add)
{
    if (add < -4096)
        return -4096;
    if (add < -32)
        return -32;
    if (add > 12287)
        return 12287;
    return add > 95 ? 95 : add;
}

/* Bend the curve of a short run so that its add takes fewer bytes, if it then
 * still meets all n windows and ends well inside the last. */
static void
save_bytes(const struct runfit *f, int64_t n, struct curve *c)
{
    int64_t add = c->add;

    if (n < 2 || n > SHORT)
        return;
    for (;;) {
        struct runfit_track t;
        struct curve bent;
        int64_t shorter = shorten_add(add);
        if (shorter == add)
            return;
        add = shorter;
        track_init(&t, add);
        if (track_run(f, &t, 1, n) < n
            || track_aim(&t, n, get_wanted(f, n), &bent)
               > f->error[f->first + n - 1] / 2)
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
start_tracks(struct runfit *f, const struct curve *c)
{
    int64_t n = f->end - f->first;

    f->n_tracks = 0;
    for (int64_t add = c->add - 1; add <= c->add + 1; add++) {
        struct runfit_track t;
        track_init(&t, add);
        if (track_run(f, &t, 1, n) == n)
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
    int64_t stored = f->end - f->first, limit, best = 0;
    struct runfit_track met[RUNFIT_TRACKS];
    int n = 0;

    limit = RUNFIT_COUNT_MAX - f->n_tracked;
    limit = limit < stored ? limit : stored;
    for (int i = 0; i < f->n_tracks; i++) {
        struct runfit_track t = f->tracks[i];
        int64_t count = track_run(f, &t, f->n_tracked + 1, limit);
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

/* The track and interval that end closest to the middle of the last window. */
static void
finish_tracks(struct runfit *f, struct steprun *run)
{
    int64_t k = f->n_tracked, best = INT64_MAX;
    struct curve chosen = { 0, 0 };

    for (int i = 0; i < f->n_tracks; i++) {
        struct curve c;
        int64_t miss = track_aim(&f->tracks[i], k, f->tracked_mid - f->start,
                                 &c);
        if (miss < best) {
            best = miss;
            chosen = c;
        }
    }
    *run = (struct steprun) {
        .start = f->start, .end = f->start + get_clock(&chosen, k),
        .interval = (uint32_t)chosen.interval, .count = (uint16_t)k,
        .add = (int16_t)chosen.add,
    };
    f->start = run->end;
    f->n_tracks = 0;
}

/* The earliest clock, from the start, of the tracked run's first step. */
static int64_t
get_first(const struct runfit *f)
{
    int64_t first = f->tracks[0].interval_lo;

    for (int i = 1; i < f->n_tracks; i++)
        if (f->tracks[i].interval_lo < first)
            first = f->tracks[i].interval_lo;
    return first;
}

/* ---- Giving out ---- */

static void
finish_curve(struct runfit *f, const struct curve *c, int64_t n,
             struct steprun *run)
{
    *run = (struct steprun) {
        .start = f->start, .end = f->start + get_clock(c, n),
        .interval = (uint32_t)c->interval, .count = (uint16_t)n,
        .add = (int16_t)c->add,
    };
    f->start = run->end;
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
    struct curve c;
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
    save_bytes(f, n, &c);
    finish_curve(f, &c, n, run);
    return 1;
}

int
runfit_take_before(struct runfit *f, int64_t limit, struct steprun *run)
{
    struct curve c;
    int64_t n;

    if (f->n_tracks) {
        if (f->start + get_first(f) >= limit)
            return 0;
        extend_tracks(f);
        finish_tracks(f, run);
        return 1;
    }
    if (f->first == f->end || f->wanted[f->first] >= limit)
        return 0;
    n = choose_length(f, &c);
    save_bytes(f, n, &c);
    finish_curve(f, &c, n, run);
    return 1;
}

int
runfit_check(const struct runfit *f)
{
    if (f->first < 0 || f->first > f->end || f->end > RUNFIT_STORE)
        return -1;
    for (int i = 0; i < f->n_tracks; i++)
        if (f->tracks[i].interval_lo > f->tracks[i].interval_hi)
            return -2;
    for (int i = f->first + 1; i < f->end; i++)
        if (f->wanted[i] - f->error[i]
            <= f->wanted[i - 1] + (int64_t)f->error[i - 1])
            return -3;
    return 0;
}
