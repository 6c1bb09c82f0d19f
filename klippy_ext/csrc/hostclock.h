/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The one way host C reads time.
 *
 * A hostclock is the first member of whatever keeps the time: the real one
 * reads CLOCK_MONOTONIC, a virtual world answers with its own time.  Times are
 * seconds (eventtime).  hostclock_now() may be called from any thread on the
 * real clock, and from the world's thread on a virtual one.
 */
#ifndef HOSTCLOCK_H
#define HOSTCLOCK_H

struct hostclock {
    double (*read)(const struct hostclock *hc);
};

static inline double
hostclock_now(const struct hostclock *hc)
{
    return hc->read(hc);
}

/* 0, or a negative number if it tells no time. */
int hostclock_check(const struct hostclock *hc);

/* The clock of the machine; static storage. */
struct hostclock *hostclock_get_real(void);

#endif
