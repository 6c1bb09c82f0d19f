/* SPDX-License-Identifier: GPL-3.0-or-later
 * A cable of a virtual world.  See vlink.h. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "vlink.h"
#include "vrandom.h"

enum { BITS_A_BYTE = 10 };

void
vlink_init(struct vlink *l, double baud, double latency, uint64_t seed,
           const double *now)
{
    memset(l, 0, sizeof(*l));
    l->byte_time = baud > 0. ? BITS_A_BYTE / baud : 0.;
    l->latency = latency;
    l->rng = seed;
    l->now = now;
    l->wake = INFINITY;
}

void
vlink_drop(struct vlink *l)
{
    for (int dir = 0; dir < VLINK_DIRECTIONS; dir++) {
        struct vlane *lane = &l->lanes[dir];
        while (lane->head) {
            struct vchunk *chunk = lane->head;
            lane->head = chunk->next;
            free(chunk);
        }
        lane->tail = NULL;
        lane->free_time = 0.;
    }
}

void
vlink_free(struct vlink *l)
{
    vlink_drop(l);
    free(l->record.buf);
    memset(&l->record, 0, sizeof(l->record));
}

void
vlink_attach(struct vlink *l, const struct vlink_host *host)
{
    l->host = *host;
    l->has_host = 1;
    vlink_wake(l);
}

void
vlink_detach(struct vlink *l)
{
    l->has_host = 0;
    l->wake = INFINITY;
}

void
vlink_wake(struct vlink *l)
{
    if (*l->now < l->wake)
        l->wake = *l->now;
}

void
vlink_set_faults(struct vlink *l, const struct vlink_faults *faults)
{
    l->faults = *faults;
    l->has_faults = faults->flip > 0. || faults->drop > 0.
        || faults->insert > 0. || faults->twice > 0.;
}

void
vlink_cut(struct vlink *l, int is_cut)
{
    l->is_cut = is_cut;
    if (is_cut)
        vlink_drop(l);
}

/* Copy bytes and hurt them; out has room for three times as many. */
static size_t
apply_faults(struct vlink *l, uint8_t *out, const uint8_t *buf, size_t len)
{
    uint8_t *p = out;

    for (size_t i = 0; i < len; i++) {
        uint8_t byte = buf[i];
        if (vrandom_unit(&l->rng) < l->faults.insert)
            *p++ = (uint8_t)vrandom_next(&l->rng);
        if (vrandom_unit(&l->rng) < l->faults.drop)
            continue;
        if (vrandom_unit(&l->rng) < l->faults.flip)
            byte ^= (uint8_t)(1u << (vrandom_next(&l->rng) & 7));
        *p++ = byte;
        if (vrandom_unit(&l->rng) < l->faults.twice)
            *p++ = byte;
    }
    return (size_t)(p - out);
}

static void
write_piece(struct vlink *l, enum vlink_direction dir, double now,
            const uint8_t *buf, size_t len)
{
    struct vlane *lane = &l->lanes[dir];
    struct vchunk *chunk;

    chunk = malloc(sizeof(*chunk) + (l->has_faults ? 3 * len : len));
    if (!chunk)
        return;
    chunk->len = len;
    if (l->has_faults)
        chunk->len = apply_faults(l, chunk->data, buf, len);
    else
        memcpy(chunk->data, buf, len);
    lane->free_time = fmax(lane->free_time, now)
        + (double)chunk->len * l->byte_time;
    chunk->time = lane->free_time + l->latency;
    if (l->faults.jitter[dir] > 0.)
        chunk->time += l->faults.jitter[dir] * vrandom_unit(&l->rng);
    chunk->next = NULL;
    if (lane->tail && chunk->time < lane->tail->time)
        chunk->time = lane->tail->time;
    if (lane->tail)
        lane->tail->next = chunk;
    else
        lane->head = chunk;
    lane->tail = chunk;
}

void
vlink_write(struct vlink *l, enum vlink_direction dir, double now,
            const uint8_t *buf, size_t len)
{
    while (len && !l->is_cut) {
        size_t count = len < VLINK_PIECE ? len : VLINK_PIECE;
        write_piece(l, dir, now, buf, count);
        buf += count;
        len -= count;
    }
}

double
vlink_get_arrival(const struct vlink *l, enum vlink_direction dir)
{
    return l->lanes[dir].head ? l->lanes[dir].head->time : INFINITY;
}

static void
record_bytes(struct vrecord *r, const void *data, size_t len)
{
    if (r->used + len > r->size) {
        size_t size = 2 * r->size + len + 4096;
        uint8_t *grown = realloc(r->buf, size);
        if (!grown) {
            r->is_full = 1;
            return;
        }
        r->buf = grown;
        r->size = size;
    }
    memcpy(r->buf + r->used, data, len);
    r->used += len;
}

static void
record_chunk(struct vrecord *r, enum vlink_direction dir,
             const struct vchunk *chunk)
{
    uint8_t dir8 = (uint8_t)dir;
    uint32_t len32 = (uint32_t)chunk->len;
    size_t start = r->used;

    record_bytes(r, &chunk->time, sizeof(chunk->time));
    record_bytes(r, &dir8, sizeof(dir8));
    record_bytes(r, &len32, sizeof(len32));
    record_bytes(r, chunk->data, chunk->len);
    if (r->is_full)
        r->used = start;
}

struct vchunk *
vlink_take(struct vlink *l, enum vlink_direction dir)
{
    struct vlane *lane = &l->lanes[dir];
    struct vchunk *chunk = lane->head;

    if (!chunk)
        return NULL;
    lane->head = chunk->next;
    if (!lane->head)
        lane->tail = NULL;
    lane->n_bytes += chunk->len;
    if (l->record.is_on && !l->record.is_full)
        record_chunk(&l->record, dir, chunk);
    return chunk;
}

void
vlink_record(struct vlink *l, int is_on)
{
    l->record.is_on = is_on;
}

static int
check_lane(const struct vlane *lane)
{
    const struct vchunk *last = NULL;

    for (const struct vchunk *c = lane->head; c; c = c->next) {
        if (c->len > 3 * VLINK_PIECE || !isfinite(c->time))
            return -82;
        if (last && c->time < last->time)
            return -83;
        last = c;
    }
    return last == lane->tail ? 0 : -84;
}

int
vlink_check(const struct vlink *l)
{
    const struct vrecord *r = &l->record;

    if (!(l->byte_time >= 0.) || !(l->latency >= 0.) || !l->now)
        return -80;
    if (r->used > r->size || !r->buf != !r->size)
        return -81;
    for (int dir = 0; dir < VLINK_DIRECTIONS; dir++)
        if (check_lane(&l->lanes[dir]))
            return check_lane(&l->lanes[dir]);
    return 0;
}
