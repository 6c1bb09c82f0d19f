/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the system may grant to those who must not wait: priority and memory
 * that stays. */
#ifndef REALTIME_H
#define REALTIME_H

/* Put the calling thread before all ordinary ones, where the system permits
 * it.  Returns 0 or a negative errno: then it stays as it is. */
int realtime_raise_thread(void);

/* Threads that were raised so far, and those that could not be. */
void realtime_get_counts(int *n_raised, int *n_refused);

/* Keep all memory that is in use, now and later, from being swapped out.
 * Returns 0, -EPERM when the process may not (a limit would make it fail later
 * on), or another negative errno. */
int realtime_lock_memory(void);

#endif
