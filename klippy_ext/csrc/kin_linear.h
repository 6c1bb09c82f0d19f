/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Steppers whose position is a weighted sum of x, y and z: cartesian, corexy,
 * corexz, hybrids and whatever else a row of three numbers describes; and a
 * constant, for carriages that follow others.
 */
#ifndef KIN_LINEAR_H
#define KIN_LINEAR_H

#include "itersolve.h"

struct kin_linear {
    struct itersolve is;        /* first */
    double coeffs[3], offset;
};

/* One block of memory: may be freed by free().  NULL when out of memory. */
struct kin_linear *kin_linear_new(double cx, double cy, double cz);
/* Other weights from now on, for which the position is the same now. */
void kin_linear_set(struct kin_linear *k, double cx, double cy, double cz,
                    double offset);

#endif
