/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The runs that a stepper was sent, for reports and for homing.
 *
 * A ring that grows as needed; the oldest entry stays, so that the position
 * after it is always known.
 */
#ifndef STEPHIST_H
#define STEPHIST_H

#include "stepcompress.h"

struct stephist {
    struct stephistory *ring;
    uint64_t mask, oldest, end;
};

/* Returns 0 or -ENOMEM. */
int stephist_init(struct stephist *h);
void stephist_free(struct stephist *h);
int stephist_add(struct stephist *h, const struct stephistory *entry);
int64_t stephist_find_position(const struct stephist *h, int64_t clock,
                               int64_t newest_position);
int stephist_extract(const struct stephist *h, struct stephistory *out,
                     int max, int64_t start, int64_t end);
void stephist_forget(struct stephist *h, int64_t clock);
/* 0, or a negative number that says which invariant does not hold. */
int stephist_check(const struct stephist *h, int64_t newest_position);

#endif
