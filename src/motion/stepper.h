/* SPDX-License-Identifier: GPL-3.0-or-later
 * Step pulses from queued runs of steps (src/stepper.c).
 *
 * A run is `count` steps; the first comes `interval` ticks after the step
 * before it, and `add` is added to the interval after every step.
 */
#ifndef MOTION_STEPPER_H
#define MOTION_STEPPER_H

#include <stdint.h>
#include "port.h"

/* Behind by more: stop rather than race.  A port may know better. */
#ifndef STEPPER_MAX_LAG_US
#define STEPPER_MAX_LAG_US 1000
#endif

/* Edges of an edge-triggered driver come no closer than this. */
#define STEPPER_EDGE_TICKS ((CONFIG_CLOCK_FREQ + 7999999) / 8000000)

/* What an event of CONFIG_HAVE_STEP_PULSE_INLINE takes from edge to edge. */
#define STEPPER_INLINE_TICKS 40

#endif
