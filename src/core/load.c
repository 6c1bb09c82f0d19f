/* SPDX-License-Identifier: GPL-3.0-or-later
 * How busy the mcu is. */
#include "core/decl.h"
#include "core/load.h"

#define SUMSQ_BASE 256

DECL_CONSTANT("STATS_SUMSQ_BASE", SUMSQ_BASE);

static struct load_stats stats;

void load_note(uint32_t ticks)
{
    uint32_t square;

    if (ticks <= 0xffff)
        square = (ticks * ticks + SUMSQ_BASE - 1) / SUMSQ_BASE;
    else if (ticks <= 0xfffff)
        square = (ticks / SUMSQ_BASE) * ticks;
    else
        square = UINT32_MAX;
    stats.count++;
    stats.sum += ticks;
    square += stats.sumsq;
    stats.sumsq = square < stats.sumsq ? UINT32_MAX : square;
}

void load_take(struct load_stats *taken)
{
    *taken = stats;
    stats = (struct load_stats){ 0 };
}
