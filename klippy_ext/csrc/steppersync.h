/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * All steppers of one mcu: makes their steps, puts their messages in the order
 * in which they are needed, and keeps within the mcu's move queue.
 *
 * The mcu has move_count cells.  A message that takes one may not arrive
 * before a cell is free: its min_clock.  A run's cell is free again when its
 * first step is due (the mcu loads a run at the step before), that of any
 * other message at its req_clock.  The ends of all cells in use are a heap of
 * exactly move_count entries, so no flush, however long, can overfill the mcu.
 *
 * Threads: one at a time.
 */
#ifndef STEPPERSYNC_H
#define STEPPERSYNC_H

#include <stdint.h>

#include "itersolve.h"
#include "qmsg.h"
#include "stepcompress.h"
#include "steppool.h"

struct steppersync;

/* move_count: cells, at least 1.  NULL when out of memory. */
struct steppersync *steppersync_new(const struct qsink *sink,
                                    uint32_t move_count);
/* Steppers and kinematics stay the caller's and must live longer. */
void steppersync_delete(struct steppersync *ss);

/* is may be NULL.  Returns the stepper's number or -ENOMEM. */
int steppersync_add(struct steppersync *ss, struct stepcompress *sc,
                    struct itersolve *is);
void steppersync_set_kinematics(struct steppersync *ss, int number,
                                struct itersolve *is);
/* For all steppers: see stepcompress_set_time(). */
void steppersync_set_time(struct steppersync *ss, double offset, double freq);

/* Make the steps of all steppers up to a print_time.  Returns 0 or what
 * itersolve_generate() says; then get_failed() is the stepper's number. */
int steppersync_generate(struct steppersync *ss, double print_time);
/* The same by the threads of a pool, and those messages that are needed before
 * `clock` are made ready, too.  To be followed by steppool_start() and, before
 * anything else with these steppers, finish().  start() returns 0 or -ENOMEM,
 * finish() as generate(): for the first stepper in order. */
int steppersync_start(struct steppersync *ss, struct steppool *pool,
                      double print_time, uint64_t clock);
int steppersync_finish(struct steppersync *ss);
int steppersync_get_failed(const struct steppersync *ss);

/* Send what is needed before `clock`; forget history before clear_clock.
 * Returns 0 or -ENOMEM. */
int steppersync_flush(struct steppersync *ss, uint64_t clock,
                      uint64_t clear_clock);

/* As flush(), with the last set_time(), of all that happens before a
 * print_time; no history is forgotten. */
int steppersync_flush_until(struct steppersync *ss, double print_time);

/* 0, or a negative number that says which invariant does not hold. */
int steppersync_check(const struct steppersync *ss);

#endif
