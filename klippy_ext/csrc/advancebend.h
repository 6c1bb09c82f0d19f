/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The part of pressure advance that is not proportional to velocity:
 * offset * g(v / velocity), where g rises from 0 with slope 1 and comes close
 * to 1: tanh(x), or 1 - 1 / (1 + x) = x / (1 + x).
 *
 * On a velocity that is a polynomial in time it is fitted, piece by piece, by
 * polynomials of degree four that meet it at both ends.
 */
#ifndef ADVANCEBEND_H
#define ADVANCEBEND_H

#include "polysolve.h"

#define ADVANCEBEND_ERROR 1e-8  /* mm */

enum advance_kind { ADVANCE_LINEAR, ADVANCE_TANH, ADVANCE_RECIPROCAL };

/* Nothing if offset is 0. */
struct bend {
    enum advance_kind kind;
    double offset, inv_velocity;        /* mm, s/mm */
};

/* mm that are added at a speed (mm/s). */
double advancebend_get(const struct bend *b, double speed);

/* Make the steps of q (in steps) plus the bend of a speed (mm/s) that has its
 * t = 0 at the same time.  Returns as itersolve_generate(). */
int advancebend_emit(struct itersolve *is, const struct bend *b,
                     const struct quartic *q, const struct quartic *speed,
                     double duration);

#endif
