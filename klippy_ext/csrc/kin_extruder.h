/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The filament drive: x is the nominal filament position.
 *
 * Pressure advance leads it by advance * velocity on segments whose
 * axes_r[1] is not 0; the result is averaged over smooth_time around each
 * moment with a weight that rises linearly to the centre and falls linearly
 * to the other end.  Without advance nothing of that happens.
 *
 * Exact: between the moments at which the middle or an end of the window
 * meets a border of segments, the average is one polynomial of degree four;
 * far from borders, of degree two.
 */
#ifndef KIN_EXTRUDER_H
#define KIN_EXTRUDER_H

#include "itersolve.h"

enum { KIN_EXTRUDER_SETTINGS = 512 };

struct advance_setting {
    double print_time;          /* for segments that begin from here on */
    double advance, half_smooth;        /* s */
};

/* An offset that goes to 0 in even steps until a time; mm, print_time. */
struct fading {
    double offset, start, end;
};

struct kin_extruder {
    struct itersolve is;        /* first */
    int n_settings;
    struct advance_setting settings[KIN_EXTRUDER_SETTINGS];
    double half;                /* half the window at is.done_time, s */
    struct fading fading;
};

/* As kin_linear_new(). */
struct kin_extruder *kin_extruder_new(void);

/* From print_time (the start of a move) on; what was set for later times is
 * dropped.  If there are too many for the moves whose steps are still to be
 * made, the oldest is forgotten.  Returns 0 or -EINVAL (negative or not
 * finite). */
int kin_extruder_set_advance(struct kin_extruder *k, double print_time,
                             double advance, double smooth_time);

#endif
