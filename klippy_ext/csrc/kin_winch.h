/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Steppers that set a distance from a point: the cables of a machine that
 * hangs on winches, and the arm of a polar one.
 *
 * Along a straight line the square of the distance is a parabola, so the
 * place of each step solves a quadratic; the stepper turns where the line
 * comes closest to the point.
 */
#ifndef KIN_WINCH_H
#define KIN_WINCH_H

#include "itersolve.h"

struct kin_winch {
    struct itersolve is;        /* first */
    double anchor[3];
    double z_share;             /* 1: distance in space; 0: in the plane */
};

/* The length of a cable from (x, y, z).  As kin_linear_new(). */
struct kin_winch *kin_winch_new(double x, double y, double z);
/* Distance from the z axis. */
struct kin_winch *kin_winch_new_radius(void);

#endif
