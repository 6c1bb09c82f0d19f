/* SPDX-License-Identifier: GPL-3.0-or-later
 * Step pulses from queued runs of steps (src/stepper.c).
 *
 * A run is `count` steps; the first comes `interval` ticks after the step
 * before it, and `add` is added to the interval after every step.
 */
#ifndef MOTION_STEPPER_H
#define MOTION_STEPPER_H

#include <stdbool.h>
#include <stdint.h>
#include "core/sched.h"
#include "port.h"

/* Behind by more: stop rather than race.  A port may know better. */
#ifndef STEPPER_MAX_LAG_US
#define STEPPER_MAX_LAG_US 1000
#endif

/* Edges of an edge-triggered driver come no closer than this. */
#define STEPPER_EDGE_TICKS ((CONFIG_CLOCK_FREQ + 7999999) / 8000000)

/* What an event of CONFIG_HAVE_STEP_PULSE_INLINE takes from edge to edge. */
#define STEPPER_INLINE_TICKS 40

/* An event that makes one edge, a step of a driver that steps on both. */
bool stepper_edge_event(struct timer *timer);

/* What the object of a stepper begins with, for a port that makes such steps in
 * its timer interrupt.  All but the last of a run (count 1) take no more than
 * this: waketime += interval, interval += add, count--, and a toggle. */
#if CONFIG_HAVE_EDGE_STEPS
typedef int32_t stepper_add_t;
typedef uint32_t stepper_count_t;
struct stepper_head {
    struct timer timer;
    uint32_t interval;
    stepper_add_t add;
    stepper_count_t count;
    struct gpio_out step_pin;
};
#else
typedef int16_t stepper_add_t;
typedef uint16_t stepper_count_t;
#endif

/* For a port that makes steps in its timer interrupt itself: the events of runs
 * whose intervals fit 16 bits and of others, and where in an object and in a
 * queued run their data lie. */
#if CONFIG_HAVE_SHORT_STEPS
bool stepper_short_event(struct timer *timer);
bool stepper_inline_event(struct timer *timer);
/* The same, but the pulse has begun; is_high is set. */
bool stepper_short_pulsed(struct timer *timer);
bool stepper_inline_pulsed(struct timer *timer);

enum {
    STEPPER_AT_INTERVAL = 8,
    STEPPER_AT_ADD = 12,
    STEPPER_AT_COUNT = 14,
    STEPPER_AT_PORT = 16,
    STEPPER_AT_DIR = 19,
    STEPPER_AT_RUNS = 20,
    STEPPER_AT_DIR_PORT = STEPPER_AT_RUNS + 2,
    STEPPER_AT_HIGH = 27,
    RUN_AT_INTERVAL = 2,
    RUN_AT_ADD = 6,
    RUN_AT_COUNT = 8,
    RUN_AT_DIR = 10,
};
#endif

#endif
