/* SPDX-License-Identifier: GPL-3.0-or-later
 * Averaged plans.  See kinkpath.h. */
#include <math.h>
#include <string.h>

#include "kinkpath.h"

/* Paths of degree two last so long (s); those of degree four so many times half
 * their mean's width, others their spread: rounding of high powers grows. */
#define PLAIN_LASTING .5
#define MEAN_LASTING 16.
#define SMOOTH_LASTING .25

void
kinkpath_init(struct kinkpath *p, const struct kink_source *source,
              int n_polys, double barrier, uint64_t hint)
{
    p->source = source;
    p->n_lines = p->n_taps = 0;
    p->n_polys = n_polys;
    p->degree = p->plain_degree = 2;
    p->reach = 0.;
    p->lasting = PLAIN_LASTING;
    p->barrier = barrier;
    p->hint = hint;
    p->time = p->renew_time = -INFINITY;
}

/* How long events of a reply may pile up. */
static double
get_lasting(const struct reply *r)
{
    double spread = reply_get_pre(r) + reply_get_post(r);

    if (r->degree > 4)
        return SMOOTH_LASTING * spread;
    return r->degree <= 2 ? PLAIN_LASTING
        : fmin(MEAN_LASTING * (r->events[1].delay - r->events[0].delay),
               PLAIN_LASTING);
}

void
kinkpath_add(struct kinkpath *p, int channel, int poly,
             const struct reply *reply)
{
    struct kink_line *line = &p->lines[p->n_lines++];

    line->channel = channel;
    line->poly = poly;
    line->reply = reply;
    for (int i = 0; i < reply->n_events; i++)
        p->taps[p->n_taps++] = (struct kink_tap) {
            .line = line, .event = &reply->events[i],
        };
    if (p->plain_degree < reply->degree)
        p->plain_degree = reply->degree;
    p->degree = p->plain_degree;
    p->reach = fmax(p->reach, reply_get_pre(reply));
    p->lasting = fmin(p->lasting, get_lasting(reply));
}

/* ---- Events ---- */

static double
get_border(const struct trapq *tq, uint64_t number)
{
    return number < tq->end ? trapq_get(tq, number)->time
        : number == tq->end ? tq->end_time : INFINITY;
}

/* sign times what an event adds, which was `late` s ago (or will be). */
static void
add_event(double q[POLY_SIZE], const struct reply_event *e,
          const struct kink *kink, double late, double sign)
{
    double part[POLY_SIZE] = { 0. };
    int n = e->high + kink->n - 1;

    reply_add(e, kink->jump, kink->n, part);
    poly_shift(part, n, late);
    for (int i = 0; i <= n; i++)
        q[i] += sign * part[i];
}

/* Arcs raise the degree, until all is made anew. */
static void
note_powers(struct kinkpath *p, int n)
{
    if (n > 3)
        p->degree = p->plain_degree + n - 3;
}

static inline int
is_flat(const struct kink *kink)
{
    for (int i = 0; i < kink->n; i++)
        if (kink->jump[i] != 0.)
            return 0;
    return 1;
}

static void
make_kink(const struct kinkpath *p, const struct kink_line *line,
          uint64_t number, struct kink *kink)
{
    const struct kink_source *s = p->source;

    kink->n = s->get_jump(s, line->channel, number, number == p->first,
                          kink->jump);
    kink->number = number;
    kink->is_flat = is_flat(kink);
    kink->border = get_border(s->tq, number);
}

/* Several events share a kink: what was asked for last is kept. */
static inline const struct kink *
get_kink(const struct kinkpath *p, struct kink_line *line, uint64_t number)
{
    struct kink *kink = &line->kept[number % KINK_KEPT];

    if (kink->number != number)
        make_kink(p, line, number, kink);
    return kink;
}

/* As set_cursor(), where the next border is no event or is not known. */
static __attribute__((noinline)) void
search_cursor(const struct kinkpath *p, struct kink_tap *tap, uint64_t number)
{
    const struct trapq *tq = p->source->tq;
    uint64_t last = number + KINK_SKIP;

    last = last < tq->end ? last : tq->end;
    while (number <= last && get_kink(p, tap->line, number)->is_flat)
        number++;
    tap->cursor = number;
    tap->next = get_border(tq, number) + tap->event->delay;
}

/* The next event of a tap is at the first border from `number` on where
 * anything jumps, if that is one of the next few. */
static inline void
set_cursor(const struct kinkpath *p, struct kink_tap *tap, uint64_t number)
{
    const struct kink *kink = &tap->line->kept[number % KINK_KEPT];

    if (kink->number != number || kink->is_flat) {
        search_cursor(p, tap, number);
        return;
    }
    tap->cursor = number;
    tap->next = kink->border + tap->event->delay;
}

/* Take what is over. */
static inline void
take_events(struct kinkpath *p, struct kink_tap *tap)
{
    do {
        double *q = p->q[tap->line->poly];
        const struct kink *kink = get_kink(p, tap->line, tap->cursor);
        note_powers(p, kink->n);
        if (tap->next == p->time)
            reply_add(tap->event, kink->jump, kink->n, q);
        else
            add_event(q, tap->event, kink, p->time - tap->next, 1.);
        set_cursor(p, tap, tap->cursor + 1);
    } while (tap->next <= p->time);
}

/* ---- Anew ---- */

/* As add_piece(), of an arc. */
static void
add_arc(double q[POLY_SIZE], const struct reply *r, const struct kink *piece,
        double t)
{
    static const double choose[KINK_SIZE][KINK_SIZE] = {
        { 1. }, { 1., 1. }, { 1., 2., 1. }, { 1., 3., 3., 1. },
        { 1., 4., 6., 4., 1. },
    };
    double p[KINK_SIZE];

    memcpy(p, piece->jump, sizeof(p));
    poly_shift(p, KINK_SIZE - 1, t);
    for (int i = 0; i < KINK_SIZE; i++) {
        double sign = 1.;
        for (int k = i; k >= 0; k--, sign = -sign)
            q[k] += sign * choose[i][k] * p[i] * r->means[i - k];
    }
}

/* The average of a piece that is all it sees; `t` s after its start. */
static void
add_piece(double q[POLY_SIZE], const struct reply *r,
          const struct kink *piece, double t)
{
    const double *p = piece->jump, *means = r->means;
    double place = p[0] + (p[1] + p[2] * t) * t, speed = p[1] + 2. * p[2] * t;

    if (piece->n > 3) {
        add_arc(q, r, piece, t);
        return;
    }
    q[0] += place * means[0] - speed * means[1] + p[2] * means[2];
    q[1] += speed * means[0] - 2. * p[2] * means[1];
    q[2] += p[2] * means[0];
}

/* Number of the segment at the oldest time that counts, and of the first one
 * whose start is an event. */
static uint64_t
find_oldest(struct kinkpath *p, uint64_t *first)
{
    const struct trapq *tq = p->source->tq;
    double oldest = fmax(p->time - p->reach, p->barrier);
    uint64_t i = p->hint = trapq_find(tq, p->hint, oldest);
    int is_walled = p->time - p->reach < p->barrier;

    *first = i + 1;
    if (i < tq->end && (trapq_get(tq, i)->time > oldest
                        || (is_walled && trapq_get(tq, i)->time == oldest)))
        *first = i;             /* it rests before that */
    p->first = *first == i ? i : UINT64_MAX;
    return i;
}

/* A kink of which some events, or all, are over.  From its middle on it is what
 * it will be in the end, less the events to come: powers of less time. */
static void
add_kink(double q[POLY_SIZE], const struct reply *r,
         const struct kink *kink, double time, double border)
{
    double late = time - border;
    int is_late = late > r->means[1];

    if (is_late)
        add_piece(q, r, kink, late);
    for (int i = 0; i < r->n_events; i++) {
        const struct reply_event *e = &r->events[i];
        int is_over = border + e->delay <= time;
        if (is_over && !is_late)
            add_event(q, e, kink, late - e->delay, 1.);
        if (!is_over && is_late)
            add_event(q, e, kink, late - e->delay, -1.);
    }
}

static void
renew_line(struct kinkpath *p, struct kink_line *line, uint64_t oldest,
           uint64_t first)
{
    const struct kink_source *s = p->source;
    double ahead = reply_get_post(line->reply), *q = p->q[line->poly];
    const struct kink *border_kink;
    struct kink piece;

    piece.n = s->get_piece(s, line->channel, oldest, first == oldest,
                           piece.jump);
    note_powers(p, piece.n);
    add_piece(q, line->reply, &piece, p->time - get_border(s->tq, oldest));
    for (uint64_t i = first; i <= s->tq->end; i++) {
        double border = get_border(s->tq, i);
        if (border - ahead > p->time)
            break;
        border_kink = get_kink(p, line, i);
        note_powers(p, border_kink->n);
        add_kink(q, line->reply, border_kink, p->time, border);
    }
}

/* Kinks depend on what was before the first segment. */
static void
forget_kinks(struct kinkpath *p)
{
    for (int i = 0; i < p->n_lines; i++)
        for (int k = 0; k < KINK_KEPT; k++)
            p->lines[i].kept[k].number = UINT64_MAX;
}

static void
find_end(struct kinkpath *p)
{
    p->end = INFINITY;
    for (int i = 0; i < p->n_taps; i++)
        p->end = p->taps[i].next < p->end ? p->taps[i].next : p->end;
}

static void
renew(struct kinkpath *p, double time)
{
    uint64_t first, oldest, before = p->first;

    p->time = time;
    p->renew_time = time + p->lasting;
    p->degree = p->plain_degree;
    memset(p->q, 0, (size_t)p->n_polys * sizeof(p->q[0]));
    oldest = find_oldest(p, &first);
    if (p->first != before)
        forget_kinks(p);
    for (int i = 0; i < p->n_lines; i++)
        renew_line(p, &p->lines[i], oldest, first);
    for (int i = 0; i < p->n_taps; i++) {
        uint64_t number = first;
        do {
            set_cursor(p, &p->taps[i], number);
            number = p->taps[i].cursor + 1;
        } while (p->taps[i].next <= time);
    }
    find_end(p);
}

static inline void
shift(double q[POLY_SIZE], int n, double by)
{
    if (n == 2) {
        q[1] += by * q[2];
        q[0] += by * q[1];
        q[1] += by * q[2];
    } else if (n == 4) {
        poly_shift(q, 4, by);
    } else {
        poly_shift(q, n, by);
    }
}

/* Does each average see one segment only? */
static int
is_whole(const struct kinkpath *p)
{
    for (int i = 1; i < p->n_taps; i++)
        if (p->taps[i].line == p->taps[i - 1].line
            && p->taps[i].cursor != p->taps[i - 1].cursor)
            return 0;
    return 1;
}

void
kinkpath_start(struct kinkpath *p, double time)
{
    forget_kinks(p);
    renew(p, time);
}

void
kinkpath_move(struct kinkpath *p, double time)
{
    double by = time - p->time, end = INFINITY;

    if (time >= p->renew_time) {
        renew(p, time);
        return;
    }
    p->time = time;
    for (int i = 0; i < p->n_polys; i++)
        shift(p->q[i], p->degree, by);
    for (int i = 0; i < p->n_taps; i++) {
        struct kink_tap *tap = &p->taps[i];
        if (tap->next <= time)
            take_events(p, tap);
        end = tap->next < end ? tap->next : end;
    }
    p->end = end;
    if (p->n_taps > 1 && is_whole(p))
        renew(p, time);
}

int
kinkpath_is_at_rest(const struct kinkpath *p)
{
    for (int i = 0; i < p->n_polys; i++)
        for (int k = 1; k <= p->degree; k++)
            if (p->q[i][k] != 0.)
                return 0;
    return 1;
}

int
kinkpath_check(const struct kinkpath *p)
{
    if (p->n_lines < 0 || p->n_lines > KINK_LINES_MAX || p->n_taps < 0
        || p->n_taps > KINK_TAPS_MAX || p->n_polys > KINK_POLYS
        || p->degree < p->plain_degree || p->degree >= POLY_SIZE)
        return -60;
    for (int i = 0; i < p->n_lines; i++) {
        int ret = reply_check(p->lines[i].reply);
        if (ret)
            return ret;
        if (p->lines[i].poly < 0 || p->lines[i].poly >= p->n_polys
            || p->lines[i].reply->degree > p->plain_degree)
            return -61;
    }
    for (int i = 0; i < p->n_taps; i++)
        if (p->taps[i].line < p->lines
            || p->taps[i].line >= p->lines + p->n_lines)
            return -62;
    return 0;
}
