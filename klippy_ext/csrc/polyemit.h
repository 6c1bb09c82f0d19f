/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Steps of a position that is any polynomial in time.
 */
#ifndef POLYEMIT_H
#define POLYEMIT_H

#include "itersolve.h"

/* Make the steps of q (mm, by power of the time since `time`), of degree n,
 * for `duration` s.  Returns as itersolve_generate(). */
int polyemit(struct itersolve *is, const double *q, int n, double time,
             double duration);

#endif
