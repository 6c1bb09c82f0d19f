/* SPDX-License-Identifier: GPL-3.0-or-later
 * Real-time priority of threads that must not wait for others. */
#ifndef REALTIME_H
#define REALTIME_H

/* Put the calling thread before all ordinary ones, where the system permits
 * it.  Returns 0 or a negative errno: then it stays as it is. */
int realtime_raise_thread(void);

/* Threads that were raised so far, and those that could not be. */
void realtime_get_counts(int *n_raised, int *n_refused);

#endif
