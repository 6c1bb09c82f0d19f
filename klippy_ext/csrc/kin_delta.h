/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The carriage of one tower of a linear delta printer.
 *
 * Its height over a nozzle position is z + sqrt(arm2 - dx^2 - dy^2).  Along a
 * straight line that has a closed form both ways: the distance s at which the
 * carriage is at a height solves a quadratic (where the line cuts the sphere
 * around the joint), and s has at most one turning point.
 */
#ifndef KIN_DELTA_H
#define KIN_DELTA_H

#include "itersolve.h"

struct kin_delta {
    struct itersolve is;        /* first */
    double arm2, tower_x, tower_y;
    double y_share;             /* 1; 0: y does not matter */
};

/* As kin_linear_new(). */
struct kin_delta *kin_delta_new(double arm2, double tower_x, double tower_y);

#endif
