/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The filament as the drive's averages see it: split by the axes along which it
 * is laid down, where those are shaped, and led by pressure advance.
 *
 * A move's filament belongs to the axes in proportion to the squares of its
 * direction (which add up to 1), so that each part is laid down by what its
 * axis contributes to the way.  What is pushed without a way is not shaped.
 *
 * On an arc the direction turns, and shares with it.  Filament of an arc comes in
 * segments that begin and end with those of the head (trapq_add_like()): over
 * each of them a part is a polynomial of degree four.
 *
 * Units: mm, s, print_time.
 */
#ifndef DRIVEPLAN_H
#define DRIVEPLAN_H

#include "advancelist.h"
#include "kinkpath.h"
#include "shaper.h"

/* Polynomials of a drive's path: filament, and the averaged speed that is led. */
enum { DRIVE_PLACE, DRIVE_SPEED, DRIVE_POLYS };
/* What is not shaped, and up to three axes (or those that are shaped alike). */
enum { DRIVE_PARTS_MAX = 4 };

struct drive_part {
    unsigned int axes;          /* bits; none for what is left */
    struct shaper_axis shaper;
};

/* How filament is shaped.  One part for all of it if there is no shaper. */
struct drive_plan {
    const struct trapq *tq, *head;      /* of the filament, of x, y, z */
    const struct advance_list *settings;
    int n_parts;
    struct drive_part parts[DRIVE_PARTS_MAX];
    double pre, post;           /* s that shapers add to what is looked at */
    uint64_t ahead;             /* of the head's numbers (a hint) */
};

/* The path by a plan and a state. */
struct drive_path {
    struct kink_source source;
    struct reply replies[DRIVE_PARTS_MAX];
    struct kinkpath kinks;
};

/* No shaper; or that of the axes of a path, for the moves of `head`. */
void driveplan_init(struct drive_plan *plan,
                    const struct advance_list *settings);
void driveplan_set_shaper(struct drive_plan *plan,
                          const struct shaper_path *path,
                          const struct trapq *head);
/* plan must stay; hint is any number of a segment.  kinkpath_start() is next. */
void driveplan_make_path(struct drive_path *path, struct drive_plan *plan,
                         const struct advance_state *state, uint64_t hint);
/* 0, or a negative number that says which invariant does not hold. */
int driveplan_check(const struct drive_plan *plan);

#endif
