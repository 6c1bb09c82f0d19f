/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Settings of pressure advance over time, each for the segments that begin
 * from its print_time on.  There is always one, and the first one serves all
 * earlier times too.
 */
#ifndef ADVANCELIST_H
#define ADVANCELIST_H

#include "advancebend.h"

enum { ADVANCELIST_SIZE = 512 };

struct advance_model {
    enum advance_kind kind;
    double linear;              /* s: mm per mm/s */
    double offset;              /* mm, of the bend */
    double velocity;            /* mm/s, scale of the bend */
    double smooth_time;         /* s */
    double time_offset;         /* s by which the drive is ahead */
};

/* How positions are made at a time. */
struct advance_state {
    double half;                /* half the window, s */
    double shift;               /* s ahead */
    struct bend bend;
};

struct advance_setting {
    double print_time;          /* for segments that begin from here on */
    double advance;             /* s */
    struct advance_state state;
};

struct advance_list {
    int count;
    struct advance_setting settings[ADVANCELIST_SIZE];
};

/* Add a setting in the place of those from print_time on; settings that serve
 * no segment from `needed` on make room.  Returns 0 or -EINVAL. */
int advancelist_add(struct advance_list *list, double print_time,
                    const struct advance_model *model, double needed);
const struct advance_setting *
advancelist_find(const struct advance_list *list, double print_time);
/* How to make positions at a time of the drive; *until is lowered to when
 * that may change. */
struct advance_state
advancelist_get_state(const struct advance_list *list, double time,
                      double *until);
int advancelist_is_same(const struct advance_state *a,
                        const struct advance_state *b);
/* How far (s) before and after a time the steps there depend on. */
void advancelist_get_scan(const struct advance_list *list, double *pre,
                          double *post);
/* 0, or a negative number that says which invariant does not hold. */
int advancelist_check(const struct advance_list *list);

#endif
