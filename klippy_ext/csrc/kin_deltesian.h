/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A carriage of a deltesian: a linear delta in the plane of x and z, to which
 * y does not matter.
 */
#ifndef KIN_DELTESIAN_H
#define KIN_DELTESIAN_H

#include "kin_delta.h"

/* The carriage at tower_x whose arm has a length of sqrt(arm2).  As
 * kin_linear_new(). */
struct kin_delta *kin_deltesian_new(double arm2, double tower_x);

#endif
