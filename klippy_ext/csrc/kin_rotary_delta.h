/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * One arm of a rotary delta: an upper arm that a motor swings about a
 * shoulder, and a lower arm from its elbow to the head.  The position is the
 * angle of the upper arm in radians: 0 level and outwards, more is higher.
 *
 * For a given angle the elbow is a point, so the place of a step is where the
 * line cuts the sphere of the lower arm around it.  A line cuts a sphere
 * twice at most, so the arm turns back once at most.
 */
#ifndef KIN_ROTARY_DELTA_H
#define KIN_ROTARY_DELTA_H

#include "itersolve.h"

struct kin_rotary_delta {
    struct itersolve is;        /* first */
    double shoulder_radius, shoulder_height;
    double cosine, sine;        /* of the direction in which the arm points */
    double upper, lower2;       /* length; square of a length */
};

/* All mm; direction in radians from the x axis.  As kin_linear_new(). */
struct kin_rotary_delta *
kin_rotary_delta_new(double shoulder_radius, double shoulder_height,
                     double direction, double upper, double lower);

#endif
