/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Steppers whose position is a weighted sum of x, y and z: cartesian, corexy,
 * corexz, hybrids and whatever else a row of three numbers describes.
 */
#ifndef KIN_LINEAR_H
#define KIN_LINEAR_H

#include "itersolve.h"

struct kin_linear {
    struct itersolve is;        /* first */
    double coeffs[3];
};

/* One block of memory: may be freed by free().  NULL when out of memory. */
struct kin_linear *kin_linear_new(double cx, double cy, double cz);

#endif
