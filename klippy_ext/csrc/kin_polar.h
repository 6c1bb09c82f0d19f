/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The turning bed of a polar machine: its angle, in radians, is that of the
 * head as seen from the centre.  (The arm is kin_winch_new_radius().)
 *
 * The angle is counted on over whole turns.  Which turn it is follows from
 * where the bed is, so it may be asked for any position.
 *
 * Within KIN_POLAR_CORE of the centre the angle of the head says nothing: a
 * line through the centre turns it in an instant.  There the bed rests while
 * the head comes closer, and turns evenly, the shorter way round, while it
 * goes away, so that it is right where the line leaves the core.  The head
 * is never further from its path than that core is wide.
 */
#ifndef KIN_POLAR_H
#define KIN_POLAR_H

#include "itersolve.h"

#define KIN_POLAR_CORE 0.01     /* mm */

struct kin_polar {
    struct itersolve is;        /* first */
    /* The turn out of the core that is under way: of the segment at this
     * time, from an angle at a place. */
    double turn_time, turn_place, turn_angle;
};

/* As kin_linear_new(). */
struct kin_polar *kin_polar_new(void);

#endif
