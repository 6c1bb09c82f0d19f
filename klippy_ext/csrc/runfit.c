/* SPDX-License-Identifier: GPL-3.0-or-later
 * Longest runs of steps.  See runfit.h. */
#include <math.h>
#include <string.h>

#include "runfit.h"

#define EPSILON 1e-9

void
runfit_reset(struct runfit *f, int64_t start)
{
    f->start = f->last_hi = start;
    f->n_fit = 0;
    f->n_stored = f->n_tracks = f->n_corners = 0;
    f->is_closing = 0;
}

/* ---- Tracks: one add, exact ---- */

static int64_t
div_up(int64_t a, int64_t b)
{
    return (a + b - 1) / b;
}

/* Let the track meet window number k (1, 2, ...).  Returns 0 if it cannot. */
static inline int
track_extend(struct runfit_track *t, int64_t k, int64_t lo, int64_t hi)
{
    t->clock_lo += t->ahead_lo;
    t->clock_hi += t->ahead_hi;
    t->ahead_lo += t->add;
    t->ahead_hi += t->add;
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

static void
track_start(struct runfit_track *t, int64_t add,
            const struct runfit_window *first)
{
    t->add = add;
    t->interval_lo = t->clock_lo = first->lo;
    t->interval_hi = t->clock_hi = first->hi;
    t->ahead_lo = first->lo + add;
    t->ahead_hi = first->hi + add;
}

/* Run the track over the stored windows of the run.  Returns how many it
 * meets; `t` is its state after those. */
static int64_t
track_replay(const struct runfit *f, struct runfit_track *t, int64_t add)
{
    int64_t k = 1;
    struct runfit_window first = {
        f->stored[0].lo - f->start, f->stored[0].hi - f->start,
    };

    track_start(t, add, &first);
    while (k < f->n_fit) {
        struct runfit_track next = *t;
        const struct runfit_window *w = &f->stored[k];
        if (!track_extend(&next, k + 1, w->lo - f->start, w->hi - f->start))
            break;
        *t = next;
        k++;
    }
    return k;
}

/* ---- Polygon: all that is possible ---- */

static void
polygon_start(struct runfit *f, int64_t lo, int64_t hi)
{
    struct runfit_corner *c = f->corners[f->side];

    c[0] = (struct runfit_corner) { INT16_MIN, (double)lo };
    c[1] = (struct runfit_corner) { INT16_MAX, (double)lo };
    c[2] = (struct runfit_corner) { INT16_MAX, (double)hi };
    c[3] = (struct runfit_corner) { INT16_MIN, (double)hi };
    f->n_corners = 4;
}

struct halfplane {
    double by_add, by_interval, limit;  /* keep what is >= limit */
};

static double
get_slack(const struct halfplane *h, const struct runfit_corner *c)
{
    return h->by_add * c->add + h->by_interval * c->interval - h->limit;
}

static int
polygon_clip(const struct runfit_corner *in, int n,
             struct runfit_corner *out, const struct halfplane *h)
{
    const struct runfit_corner *from = &in[n - 1];
    double before = get_slack(h, from);
    int count = 0;

    for (int i = 0; i < n; i++) {
        double now = get_slack(h, &in[i]);
        if ((now >= 0.) != (before >= 0.)) {
            double part = before / (before - now);
            out[count].add = from->add + part * (in[i].add - from->add);
            out[count++].interval = from->interval
                + part * (in[i].interval - from->interval);
        }
        if (now >= 0.)
            out[count++] = in[i];
        from = &in[i];
        before = now;
    }
    return count;
}

/* Clip by window number k into the other side.  Returns the number of
 * corners, or -1 when the window takes nothing away. */
static int
polygon_cut(struct runfit *f, int64_t k, double lo, double hi)
{
    const struct runfit_corner *c = f->corners[f->side];
    struct runfit_corner half[RUNFIT_CORNERS + 2];
    double steps = (double)k, growth = .5 * steps * (steps - 1.);
    struct halfplane above = { growth, steps, lo };
    struct halfplane below = { -growth, -steps, -hi };
    double least = INFINITY, most = -INFINITY;
    int n;

    for (int i = 0; i < f->n_corners; i++) {
        double clock = growth * c[i].add + steps * c[i].interval;
        least = clock < least ? clock : least;
        most = clock > most ? clock : most;
    }
    if (least >= lo && most <= hi)
        return -1;
    n = polygon_clip(c, f->n_corners, half, &above);
    return n ? polygon_clip(half, n, f->corners[!f->side], &below) : 0;
}

static void
get_add_range(const struct runfit_corner *c, int n, int64_t *lo, int64_t *hi)
{
    double least = INFINITY, most = -INFINITY;

    for (int i = 0; i < n; i++) {
        least = fmin(least, c[i].add);
        most = fmax(most, c[i].add);
    }
    *lo = (int64_t)ceil(least - EPSILON);
    *hi = (int64_t)floor(most + EPSILON);
}

/* ---- From polygon to tracks ---- */

/* Up to RUNFIT_TRACKS whole numbers in the middle of the polygon. */
static int64_t
choose_adds(const struct runfit *f, int *n)
{
    int64_t lo, hi, first;

    get_add_range(f->corners[f->side], f->n_corners, &lo, &hi);
    if (lo > hi)
        hi = lo;
    first = lo + (hi - lo + 1 - RUNFIT_TRACKS) / 2;
    first = first > lo ? first : lo;
    *n = hi - first + 1 < RUNFIT_TRACKS ? (int)(hi - first + 1)
                                        : RUNFIT_TRACKS;
    return first < INT16_MIN ? INT16_MIN
        : first > INT16_MAX ? INT16_MAX : first;
}

static void
drop_stored(struct runfit *f, int64_t count)
{
    f->n_stored -= (int)count;
    memmove(f->stored, f->stored + count,
            (size_t)f->n_stored * sizeof(*f->stored));
}

/* Replace the polygon by tracks; stored is then what they do not meet yet.
 * The run may become shorter: n_fit. */
static void
start_tracks(struct runfit *f)
{
    int64_t best = 0, met, first;
    struct runfit_track t;
    int n;

    first = choose_adds(f, &n);
    f->n_tracks = 0;
    for (int i = 0; i < n; i++) {
        met = track_replay(f, &t, first + i);
        if (met < best)
            continue;
        if (met > best)
            f->n_tracks = 0;
        best = met;
        f->tracks[f->n_tracks++] = t;
    }
    f->last_mid = (f->stored[best - 1].lo + f->stored[best - 1].hi) / 2;
    f->n_fit = best;
    drop_stored(f, best);
}

/* ---- One more window ---- */

/* Returns 0 if no track can meet it. */
static int
extend_tracks(struct runfit *f, int64_t lo, int64_t hi)
{
    struct runfit_track next[RUNFIT_TRACKS];
    int n = 0;

    if (f->n_fit >= RUNFIT_COUNT_MAX)
        return 0;
    for (int i = 0; i < f->n_tracks; i++) {
        next[n] = f->tracks[i];
        n += track_extend(&next[n], f->n_fit + 1, lo - f->start,
                          hi - f->start);
    }
    if (!n)
        return 0;
    memcpy(f->tracks, next, (size_t)n * sizeof(*next));
    f->n_tracks = n;
    f->n_fit++;
    f->last_mid = (lo + hi) / 2;
    return 1;
}

static int
extend_polygon(struct runfit *f, int64_t lo, int64_t hi)
{
    int64_t add_lo, add_hi;
    int n = polygon_cut(f, f->n_fit + 1, (double)(lo - f->start),
                        (double)(hi - f->start));

    if (n < 0) {
        f->n_fit++;
        return 1;
    }
    if (!n)
        return 0;
    get_add_range(f->corners[!f->side], n, &add_lo, &add_hi);
    if (add_lo > add_hi)
        return 0;
    f->side = !f->side;
    f->n_corners = n;
    f->n_fit++;
    if (add_hi - add_lo >= RUNFIT_TRACKS && n < RUNFIT_CORNERS - 2)
        return 1;
    n = (int)f->n_fit;
    start_tracks(f);
    return f->n_fit == n;
}

static int
is_tracking(const struct runfit *f)
{
    return f->n_tracks > 0;
}

static int
fit_polygon(struct runfit *f)
{
    while (!is_tracking(f) && f->n_fit < f->n_stored) {
        const struct runfit_window *w = &f->stored[f->n_fit];
        if (!f->n_fit) {
            polygon_start(f, w->lo - f->start, w->hi - f->start);
            f->n_fit = 1;
        } else if (!extend_polygon(f, w->lo, w->hi)) {
            return 0;
        }
    }
    return 1;
}

/* Fit the stored windows that are not yet.  Returns 0 when one ends the run. */
static int
fit_stored(struct runfit *f)
{
    int n = 0;

    if (!fit_polygon(f))
        return 0;
    if (!is_tracking(f))
        return 1;
    while (n < f->n_stored
           && extend_tracks(f, f->stored[n].lo, f->stored[n].hi))
        n++;
    drop_stored(f, n);
    return f->n_stored == 0;
}

int
runfit_add(struct runfit *f, int64_t lo, int64_t hi)
{
    lo = lo > f->last_hi ? lo : f->last_hi + 1;
    hi = hi > lo ? hi : lo;
    f->last_hi = hi;
    if (is_tracking(f) && !f->n_stored && extend_tracks(f, lo, hi))
        return 0;
    f->stored[f->n_stored++] = (struct runfit_window) { lo, hi };
    if (!fit_stored(f))
        return 1;
    if (f->n_stored == RUNFIT_STORE)
        start_tracks(f);
    return is_tracking(f) && f->n_stored > 0;
}

void
runfit_close(struct runfit *f)
{
    f->is_closing = 1;
}

/* ---- Giving out ---- */

/* The track and interval that end closest to the middle of the last window. */
static void
choose_run(const struct runfit *f, struct steprun *run)
{
    int64_t k = f->n_fit, best = INT64_MAX;

    for (int i = 0; i < f->n_tracks; i++) {
        const struct runfit_track *t = &f->tracks[i];
        int64_t growth = t->add * (k * (k - 1) / 2);
        int64_t wanted = f->last_mid - f->start - growth;
        int64_t interval = (wanted + k / 2) / k, miss;
        if (interval < t->interval_lo)
            interval = t->interval_lo;
        if (interval > t->interval_hi)
            interval = t->interval_hi;
        miss = interval * k - wanted;
        miss = miss < 0 ? -miss : miss;
        if (miss >= best)
            continue;
        best = miss;
        run->add = (int16_t)t->add;
        run->interval = (uint32_t)interval;
        run->end = f->start + interval * k + growth;
    }
    if (k == 1)
        run->add = 0;
    run->start = f->start;
    run->count = (uint16_t)k;
}

int
runfit_take(struct runfit *f, struct steprun *run)
{
    if (fit_stored(f) && !(f->is_closing && f->n_fit)) {
        f->is_closing = 0;
        return 0;
    }
    if (!is_tracking(f))
        start_tracks(f);
    choose_run(f, run);
    f->start = run->end;
    f->n_fit = f->n_tracks = 0;
    return 1;
}

int64_t
runfit_get_first(const struct runfit *f)
{
    if (is_tracking(f))
        return f->start + f->tracks[0].interval_lo;
    return f->stored[0].lo;
}

int
runfit_check(const struct runfit *f)
{
    if (f->n_stored < 0 || f->n_stored > RUNFIT_STORE)
        return -1;
    for (int i = 0; i < f->n_tracks; i++)
        if (f->tracks[i].interval_lo > f->tracks[i].interval_hi)
            return -2;
    for (int i = 1; i < f->n_stored; i++)
        if (f->stored[i].lo <= f->stored[i - 1].hi)
            return -3;
    return f->n_fit && !f->n_tracks && f->n_fit > f->n_stored ? -4 : 0;
}
