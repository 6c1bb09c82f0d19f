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

/* Runs whose intervals fit 16 bits, for a port that makes their steps in its
 * timer interrupt: the event, and where in the object its data lie. */
#if CONFIG_HAVE_SHORT_STEPS
#include <stdbool.h>
#include "core/sched.h"

bool stepper_short_event(struct timer *timer);

enum {
    STEPPER_AT_INTERVAL = 8,
    STEPPER_AT_ADD = 12,
    STEPPER_AT_COUNT = 14,
    STEPPER_AT_PORT = 16,
    STEPPER_AT_BIT = 18,
};
#endif

#endif
