/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Linear estimate of an mcu's 64 bit clock from host time.
 *
 * freq 0 means that nothing is known yet.  last_clock is the newest clock that
 * is certain; 32 bit clocks from the wire are within 2^31 ticks of it.
 */
#ifndef CLOCKEST_H
#define CLOCKEST_H

#include <math.h>
#include <stdint.h>

struct clockest {
    double freq;                /* ticks a second of host time */
    double conv_time;           /* s, host time of conv_clock */
    uint64_t conv_clock, last_clock;
};

static inline int
clockest_is_known(const struct clockest *ce)
{
    return ce->freq > 0.;
}

static inline uint64_t
clockest_clock_at(const struct clockest *ce, double time)
{
    double clock = (double)ce->conv_clock + (time - ce->conv_time) * ce->freq;

    return clock > 0. ? (uint64_t)clock : 0;
}

static inline double
clockest_time_at(const struct clockest *ce, uint64_t clock)
{
    double ticks = (double)(int64_t)(clock - ce->conv_clock);

    return ce->conv_time + ticks / ce->freq;
}

static inline uint64_t
clockest_extend(const struct clockest *ce, uint32_t clock32)
{
    int32_t diff = (int32_t)(clock32 - (uint32_t)ce->last_clock);

    return ce->last_clock + (uint64_t)(int64_t)diff;
}

/* 0, or a negative number that says which invariant does not hold. */
static inline int
clockest_check(const struct clockest *ce)
{
    if (!(ce->freq >= 0.) || !isfinite(ce->freq + ce->conv_time))
        return -98;
    if (!clockest_is_known(ce))
        return 0;
    /* what is estimated is told again */
    return fabs(clockest_time_at(ce, ce->conv_clock) - ce->conv_time) > 1e-9
        ? -99 : 0;
}

#endif
