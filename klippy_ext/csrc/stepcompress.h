/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Steps of one stepper, as times, turned into messages for the mcu.
 *
 * Times come in order.  A step may be up to max_error ticks early or late, but
 * never by half the time to its neighbours: steps keep their order and runs
 * join.  Two opposite steps within twice max_error cancel each other: they
 * could have been moved onto one another.  The newest step is held until the
 * one after it (or the end of the time made so far) is known.
 *
 * Messages wait in `out` until the steppersync collects them.  Those that
 * occupy a cell of the mcu's move queue have min_clock STEPMSG_CELL, others 0;
 * req_clock is when they are needed.
 *
 * Clocks are 64 bit ticks of the mcu; positions are steps.
 * All functions that make messages return 0 or -ENOMEM.
 */
#ifndef STEPCOMPRESS_H
#define STEPCOMPRESS_H

#include <stddef.h>
#include <stdint.h>

#include "qmsg.h"
#include "runfit.h"
#include "stepway.h"

enum { STEPMSG_CELL = 1 };

struct stephistory {
    int64_t first_clock, last_clock, start_position;
    int32_t count;              /* negative: downwards; 0: a mark */
    int32_t add;
    uint32_t interval;
};

struct stepcompress_options {
    uint32_t max_error, queue_step_tag, set_dir_tag;
    int invert_dir;
};

struct stepcompress;

/* NULL when out of memory. */
struct stepcompress *stepcompress_new(uint32_t oid);
void stepcompress_delete(struct stepcompress *sc);
/* A change of invert_dir is for the runs to come. */
void stepcompress_configure(struct stepcompress *sc,
                            const struct stepcompress_options *options);
/* clock = (print_time - offset) * freq */
void stepcompress_set_time(struct stepcompress *sc, double offset,
                           double freq);

/* Add n steps in one direction (+1 or -1) at these print_times. */
int stepcompress_push(struct stepcompress *sc, const double *times, int n,
                      int dir);
/* As before, at the times of a way. */
int stepcompress_push_way(struct stepcompress *sc, const struct stepway *w,
                          int64_t n, int dir);
/* No step will come before this print_time. */
void stepcompress_note_made(struct stepcompress *sc, double print_time);
/* Make messages of all runs that begin before `clock`. */
int stepcompress_flush(struct stepcompress *sc, int64_t clock);
/* Make messages of everything and forget the direction; the next step's
 * interval counts from `clock`. */
int stepcompress_reset(struct stepcompress *sc, int64_t clock);
/* Add a message after everything so far.  req_clock 0: needed as soon as what
 * came before; else it takes a cell of the move queue until then. */
int stepcompress_add_message(struct stepcompress *sc, const uint8_t *data,
                             size_t len, uint64_t req_clock);

/* What the stepper counts from now on (after all steps so far). */
int stepcompress_set_last_position(struct stepcompress *sc, int64_t clock,
                                   int64_t position);
int64_t stepcompress_get_last_position(const struct stepcompress *sc);
/* Position at a clock in the past, as far as the history goes. */
int64_t stepcompress_find_position(const struct stepcompress *sc,
                                   int64_t clock);
/* Runs that overlap [start, end], newest first; returns their number. */
int stepcompress_extract(const struct stepcompress *sc,
                         struct stephistory *out, int max, int64_t start,
                         int64_t end);
void stepcompress_forget(struct stepcompress *sc, int64_t clock);

struct qfifo *stepcompress_get_out(struct stepcompress *sc);
/* Steps made and runs sent so far. */
void stepcompress_get_counts(const struct stepcompress *sc, uint64_t *n_steps,
                             uint64_t *n_runs);
/* 0, or a negative number that says which invariant does not hold. */
int stepcompress_check(const struct stepcompress *sc);

#endif
