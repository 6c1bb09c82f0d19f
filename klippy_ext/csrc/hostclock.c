/* SPDX-License-Identifier: GPL-3.0-or-later
 * The real clock.  See hostclock.h. */
#include <math.h>
#include <time.h>

#include "hostclock.h"

static double
read_monotonic(const struct hostclock *hc)
{
    struct timespec ts;

    (void)hc;
    clock_gettime(CLOCK_MONOTONIC, &ts);
    return (double)ts.tv_sec + (double)ts.tv_nsec * 1e-9;
}

static struct hostclock real_clock = { .read = read_monotonic };

struct hostclock *
hostclock_get_real(void)
{
    return &real_clock;
}

int
hostclock_check(const struct hostclock *hc)
{
    double first, second;

    if (!hc->read)
        return -96;
    first = hostclock_now(hc);
    second = hostclock_now(hc);
    return first >= 0. && second >= first && isfinite(second) ? 0 : -97;
}
