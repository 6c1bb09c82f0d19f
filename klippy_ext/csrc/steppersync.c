/* SPDX-License-Identifier: GPL-3.0-or-later
 * All steppers of one mcu.  See steppersync.h. */
#include <errno.h>
#include <stdlib.h>

#include "steppersync.h"

struct member {
    struct stepcompress *sc;
    struct itersolve *is;
    /* What start() asked for, and what became of it */
    double until;
    int64_t clock;
    int ret;
};

struct steppersync {
    struct qsink sink;
    struct member *members;
    int n_members, failed;
    double offset, freq;
    uint32_t move_count;
    uint32_t first;             /* cell that is free first */
    uint64_t *cells;            /* ring, in order: when each becomes free */
};

struct steppersync *
steppersync_new(const struct qsink *sink, uint32_t move_count)
{
    struct steppersync *ss = calloc(1, sizeof(*ss));

    if (!ss)
        return NULL;
    ss->sink = *sink;
    ss->move_count = move_count ? move_count : 1;
    ss->cells = calloc(ss->move_count, sizeof(*ss->cells));
    if (!ss->cells) {
        free(ss);
        return NULL;
    }
    return ss;
}

void
steppersync_delete(struct steppersync *ss)
{
    if (!ss)
        return;
    free(ss->members);
    free(ss->cells);
    free(ss);
}

int
steppersync_add(struct steppersync *ss, struct stepcompress *sc,
                struct itersolve *is)
{
    size_t count = (size_t)ss->n_members + 1;
    struct member *grown = realloc(ss->members, count * sizeof(*grown));

    if (!grown)
        return -ENOMEM;
    ss->members = grown;
    grown[ss->n_members] = (struct member) { .sc = sc, .is = is };
    if (ss->freq > 0.)
        stepcompress_set_time(sc, ss->offset, ss->freq);
    return ss->n_members++;
}

void
steppersync_set_kinematics(struct steppersync *ss, int number,
                           struct itersolve *is)
{
    ss->members[number].is = is;
}

void
steppersync_set_time(struct steppersync *ss, double offset, double freq)
{
    ss->offset = offset;
    ss->freq = freq;
    for (int i = 0; i < ss->n_members; i++)
        stepcompress_set_time(ss->members[i].sc, offset, freq);
}

int
steppersync_generate(struct steppersync *ss, double print_time)
{
    int ret = 0;

    for (int i = 0; i < ss->n_members && !ret; i++) {
        if (!ss->members[i].is)
            continue;
        ret = itersolve_generate(ss->members[i].is, print_time);
        ss->failed = i;
    }
    return ret;
}

/* The steps of one stepper, and those of its messages that are due. */
static void
make_steps(void *ctx)
{
    struct member *m = ctx;

    m->ret = itersolve_generate(m->is, m->until);
    if (!m->ret)
        m->ret = stepcompress_flush(m->sc, m->clock);
}

int
steppersync_start(struct steppersync *ss, struct steppool *pool,
                  double print_time, uint64_t clock)
{
    for (int i = 0; i < ss->n_members; i++) {
        struct member *m = &ss->members[i];
        m->until = print_time;
        m->clock = (int64_t)clock;
        m->ret = 0;
        if (m->is && steppool_add(pool, make_steps, m))
            return -ENOMEM;
    }
    return 0;
}

int
steppersync_finish(struct steppersync *ss)
{
    steppool_settle();
    for (int i = 0; i < ss->n_members; i++) {
        ss->failed = i;
        if (ss->members[i].ret)
            return ss->members[i].ret;
    }
    return 0;
}

int
steppersync_get_failed(const struct steppersync *ss)
{
    return ss->failed;
}

/* ---- Cells ---- */

/* Take the cell that is free first, until `until`, which is hardly ever before
 * that of another one.  Returns when that is. */
static uint64_t
take_cell(struct steppersync *ss, uint64_t until)
{
    uint64_t *cells = ss->cells, first = cells[ss->first];
    uint32_t last = ss->move_count - 1, hole = ss->first, before;

    for (;; hole = before) {
        before = hole ? hole - 1 : last;
        if (before == ss->first || cells[before] <= until)
            break;
        cells[hole] = cells[before];
    }
    cells[hole] = until;
    ss->first = ss->first == last ? 0 : ss->first + 1;
    return first;
}

/* The stepper whose next message is needed first, before `clock`. */
static struct qfifo *
find_first(const struct steppersync *ss, uint64_t clock)
{
    struct qfifo *best = NULL;

    for (int i = 0; i < ss->n_members; i++) {
        struct qfifo *out = stepcompress_get_out(ss->members[i].sc);
        if (!out->head || out->head->req_clock >= clock)
            continue;
        if (!best || out->head->req_clock < best->head->req_clock)
            best = out;
    }
    return best;
}

int
steppersync_flush(struct steppersync *ss, uint64_t clock, uint64_t clear_clock)
{
    struct qfifo batch = { NULL, NULL }, *out;
    int ret = 0;

    for (int i = 0; i < ss->n_members; i++) {
        struct stepcompress *sc = ss->members[i].sc;
        int err = stepcompress_flush(sc, (int64_t)clock);
        ret = ret ? ret : err;
        stepcompress_forget(sc, (int64_t)clear_clock);
    }
    while ((out = find_first(ss, clock)) != NULL) {
        struct qmsg *m = qfifo_pop(out);
        if (m->min_clock == STEPMSG_CELL)
            m->min_clock = take_cell(ss, m->req_clock);
        qfifo_push(&batch, m);
    }
    if (!qfifo_is_empty(&batch))
        ss->sink.send_batch(ss->sink.ctx, &batch);
    return ret;
}

int
steppersync_flush_until(struct steppersync *ss, double print_time)
{
    double clock = (print_time - ss->offset) * ss->freq;

    return steppersync_flush(ss, clock > 0. ? (uint64_t)clock : 0, 0);
}

int
steppersync_check(const struct steppersync *ss)
{
    for (uint32_t i = 1; i < ss->move_count; i++) {
        uint32_t cell = (ss->first + i) % ss->move_count;
        if (ss->cells[cell] < ss->cells[(cell ? cell : ss->move_count) - 1])
            return -1;
    }
    for (int i = 0; i < ss->n_members; i++) {
        const struct member *m = &ss->members[i];
        int ret = stepcompress_check(m->sc);
        if (!ret && m->is)
            ret = itersolve_check(m->is);
        if (ret)
            return ret;
    }
    return 0;
}
