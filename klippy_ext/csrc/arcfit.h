/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Steps along an arc for any kind of kinematics: the position over time is
 * fitted by polynomials (shaperfit.h).
 */
#ifndef ARCFIT_H
#define ARCFIT_H

#include "itersolve.h"

/* Make the steps of an arc between two times from its start.  Returns as
 * itersolve_generate(). */
int arcfit_emit(struct itersolve *is, const struct trapseg *seg, double from,
                double to);

#endif
