/* SPDX-License-Identifier: GPL-3.0-or-later
 * Outputs that change at given clocks, and must not be left on.
 *
 * Values wait in a queue.  While an output is away from its default for
 * max_duration without a new value, the mcu shuts down: the host has died.  An
 * output that is told to rest goes to its default instead, and the host is told.
 */
#ifndef IO_TIMED_OUTPUT_H
#define IO_TIMED_OUTPUT_H

#include <stdbool.h>
#include <stdint.h>
#include "board/mem.h"
#include "core/sched.h"

#define TIMED_OUTPUT_REST !CONFIG_HAVE_TINY_CODE_SIZE

struct timed_output;

struct timed_output_kind {
    /* Irq: set the output; returns whether that is its default. */
    bool (*apply)(struct timed_output *out, uint32_t value, uint32_t clock);
    /* Irqs off: set the output to its default. */
    void (*rest)(struct timed_output *out);
    struct task_wake *wake;   /* of a task that tells the host that one rests */
    uint16_t missed, exceeds; /* shutdown reasons */
};

struct timed_output {
    struct timer timer;
    struct timed_value *first, **last; /* last: where the next one goes */
    const struct timed_output_kind *kind;
    uint32_t max_duration; /* ticks; 0: no limit */
    bool is_waiting;       /* the timer is set */
    bool has_limit;        /* ... to the end of max_duration */
    bool is_default;       /* what was applied last */
    bool is_resting;       /* no shutdown when max_duration is over */
    bool is_expired;       /* ... it was, and the host is to be told */
};

/* Task: prepare, with the output at `clock` away from its default or not. */
void timed_output_setup(struct timed_output *out,
                        const struct timed_output_kind *kind,
                        uint32_t max_duration);
void timed_output_start(struct timed_output *out, bool is_default);

/* Task: take `value` at `clock`. */
void timed_output_queue(struct timed_output *out, uint32_t clock,
                        uint32_t value);

#if TIMED_OUTPUT_REST
/* Task: has it expired, since the last call? */
bool timed_output_take_expired(struct timed_output *out);
#endif

/* Task: values are waiting. */
bool timed_output_is_pending(const struct timed_output *out);

/* Shutdown: forget what is queued. */
void timed_output_clear(struct timed_output *out);

#endif
