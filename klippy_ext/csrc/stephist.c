/* SPDX-License-Identifier: GPL-3.0-or-later
 * The runs that a stepper was sent.  See stephist.h. */
#include <errno.h>
#include <stdlib.h>

#include "stephist.h"

enum { RING_MIN = 32 };

int
stephist_init(struct stephist *h)
{
    h->oldest = h->end = 0;
    h->mask = RING_MIN - 1;
    h->ring = malloc(RING_MIN * sizeof(*h->ring));
    return h->ring ? 0 : -ENOMEM;
}

void
stephist_free(struct stephist *h)
{
    free(h->ring);
}

static const struct stephistory *
get(const struct stephist *h, uint64_t number)
{
    return &h->ring[number & h->mask];
}

static int
resize(struct stephist *h, uint64_t size)
{
    struct stephistory *ring = malloc(size * sizeof(*ring));

    if (!ring)
        return -ENOMEM;
    for (uint64_t i = h->oldest; i < h->end; i++)
        ring[i & (size - 1)] = *get(h, i);
    free(h->ring);
    h->ring = ring;
    h->mask = size - 1;
    return 0;
}

int
stephist_add(struct stephist *h, const struct stephistory *entry)
{
    if (h->end - h->oldest > h->mask && resize(h, 2 * (h->mask + 1)))
        return -ENOMEM;
    h->ring[h->end++ & h->mask] = *entry;
    return 0;
}

/* Steps of the run that are done at `clock`. */
static int64_t
count_done(const struct stephistory *e, int64_t clock)
{
    int64_t start = e->first_clock - e->interval, low = 0;
    int64_t high = e->count < 0 ? -(int64_t)e->count : e->count;

    if (clock >= e->last_clock)
        return high;
    while (low < high) {
        int64_t k = (low + high + 1) / 2;
        if (start + e->interval * k + e->add * (k * (k - 1) / 2) <= clock)
            low = k;
        else
            high = k - 1;
    }
    return low;
}

int64_t
stephist_find_position(const struct stephist *h, int64_t clock,
                       int64_t newest_position)
{
    int64_t position = newest_position;

    for (uint64_t i = h->end; i > h->oldest; i--) {
        const struct stephistory *e = get(h, i - 1);
        if (clock >= e->first_clock) {
            int64_t done = count_done(e, clock);
            return e->start_position + (e->count < 0 ? -done : done);
        }
        position = e->start_position;
    }
    return position;
}

int
stephist_extract(const struct stephist *h, struct stephistory *out, int max,
                 int64_t start, int64_t end)
{
    int count = 0;

    for (uint64_t i = h->end; i > h->oldest && count < max; i--) {
        const struct stephistory *e = get(h, i - 1);
        if (e->last_clock < start)
            break;
        if (e->first_clock <= end)
            out[count++] = *e;
    }
    return count;
}

void
stephist_forget(struct stephist *h, int64_t clock)
{
    uint64_t size = h->mask + 1;

    while (h->oldest + 1 < h->end && get(h, h->oldest)->last_clock < clock)
        h->oldest++;
    if (size > RING_MIN && h->end - h->oldest < size / 8)
        (void)resize(h, size / 2);      /* no memory: stays as it is */
}

int
stephist_check(const struct stephist *h, int64_t newest_position)
{
    if (h->oldest > h->end || h->end - h->oldest > h->mask + 1)
        return -1;
    for (uint64_t i = h->oldest; i < h->end; i++) {
        const struct stephistory *e = get(h, i);
        int is_last = i + 1 == h->end;
        int64_t after = e->start_position + e->count;
        if (e->last_clock < e->first_clock)
            return -2;
        if (is_last ? after != newest_position
                    : get(h, i + 1)->count
                      && after != get(h, i + 1)->start_position)
            return -3;
    }
    return 0;
}
