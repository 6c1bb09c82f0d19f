/* SPDX-License-Identifier: GPL-3.0-or-later
 * How busy the mcu is, for the host's statistics.
 */
#ifndef CORE_LOAD_H
#define CORE_LOAD_H

#include <stdint.h>

/* Times that the main loop has been busy: their number, their sum in ticks, and
 * the sum of their squares, over the constant STATS_SUMSQ_BASE. */
struct load_stats {
    uint32_t count, sum, sumsq;
};

/* Task: it has been busy for `ticks`. */
void load_note(uint32_t ticks);

/* Task: what was noted since the last call. */
void load_take(struct load_stats *taken);

#endif
