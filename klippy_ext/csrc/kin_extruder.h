/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The filament drive: x is the nominal filament position.
 *
 * Pressure advance leads it by linear * velocity on segments whose axes_r[1]
 * is not 0; the result is averaged over smooth_time around each moment with a
 * weight that rises linearly to the centre and falls linearly to the other
 * end.  A model that bends adds its part for the averaged velocity of those
 * segments (advancebend.h).  The drive is where all this tells for time_offset
 * later.  Without a lead nothing is averaged.
 *
 * Exact but for the bend: between the moments at which the middle or an end of
 * the window meets a border of segments, the averages are one polynomial of
 * degree four; far from borders, of degree two.
 */
#ifndef KIN_EXTRUDER_H
#define KIN_EXTRUDER_H

#include "advancelist.h"

/* An offset that goes to 0 in even steps until a time; mm, print_time. */
struct fading {
    double offset, start, end;
};

struct kin_extruder {
    struct itersolve is;        /* first */
    struct advance_list settings;
    struct advance_state state; /* at is.done_time */
    struct fading fading;
};

/* As kin_linear_new(). */
struct kin_extruder *kin_extruder_new(void);

/* From print_time (the start of a move) on; what was set for later times is
 * dropped.  If there are too many for the moves whose steps are still to be
 * made, the oldest is forgotten.  Where a setting would make the position
 * jump, the difference fades away instead.
 * Returns 0 or -EINVAL (not finite, or negative and not time_offset; or a
 * bend without velocity). */
int kin_extruder_set_model(struct kin_extruder *k, double print_time,
                           const struct advance_model *model);
/* A linear model without time offset. */
int kin_extruder_set_advance(struct kin_extruder *k, double print_time,
                             double advance, double smooth_time);

#endif
