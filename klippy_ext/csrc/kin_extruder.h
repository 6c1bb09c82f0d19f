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
 * With a shaper the filament of each axis is averaged as the axis itself
 * (driveplan.h), too, so that it comes where and when the nozzle does.
 *
 * Exact but for the bend and smooth kernels, which are fitted: the averages are
 * polynomials that follow each other (kinkpath.h).
 */
#ifndef KIN_EXTRUDER_H
#define KIN_EXTRUDER_H

#include "driveplan.h"

/* An offset that goes to 0 in even steps until a time; mm, print_time. */
struct fading {
    double offset, start, end;
};

struct kin_extruder {
    struct itersolve is;        /* first */
    struct advance_list settings;
    struct advance_state state; /* at is.done_time */
    struct fading fading;
    struct drive_plan plan;
    struct drive_path path;     /* by `state` */
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
/* Be shaped as the axes of a path (copied) on the moves of `head`; NULL for
 * neither.  All steps must be made, and the filament must rest as far as the
 * old and the new averages look. */
void kin_extruder_set_shaper(struct kin_extruder *k,
                             const struct shaper_path *path,
                             const struct trapq *head);

#endif
