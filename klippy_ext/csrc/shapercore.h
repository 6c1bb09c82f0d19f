/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Steps of a bed that turns, where a shaped path comes near its centre.
 *
 * As on the plan (kin_polar.h) the bed rests while the head comes closer within
 * the core, and turns while it goes away, evenly with the distance, the shorter
 * way round to where the line on which the head then is leaves the core.  Each
 * piece of the path begins such a turn anew, from where the bed is.
 */
#ifndef SHAPERCORE_H
#define SHAPERCORE_H

#include "itersolve.h"
#include "shaperfit.h"

/* The steps between two times without an event; get and data tell the angle
 * outside of the core.  Returns as itersolve_generate(). */
int shapercore_emit(struct itersolve *is, shaperfit_get get, void *data,
                    double time, double until);

#endif
