/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Steps of a position that is known at any time, but has no simple formula.
 */
#ifndef SHAPERFIT_H
#define SHAPERFIT_H

#include "itersolve.h"

/* Position (mm or radians) of the stepper at a time; smooth in between. */
typedef double (*shaperfit_get)(void *data, double time);

/* Make the steps between two times.  Positions that differ by `period` are
 * the same, unless that is 0.  Returns as itersolve_generate(). */
int shaperfit_emit(struct itersolve *is, shaperfit_get get, void *data,
                   double period, double from, double to);

/* The same with fits that are no further off than `error` (mm or radians). */
int shaperfit_emit_within(struct itersolve *is, shaperfit_get get, void *data,
                          double period, double error, double from,
                          double to);

#endif
