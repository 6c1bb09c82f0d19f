/* SPDX-License-Identifier: GPL-3.0-or-later
 * See realtime.h. */
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>

#include "realtime.h"

/* Low among the real-time priorities: the kernel's own threads have 50 */
enum { PRIORITY = 5 };

static atomic_int n_raised, n_refused;

int
realtime_raise_thread(void)
{
    struct sched_param param = { .sched_priority = PRIORITY };
    int error = pthread_setschedparam(pthread_self(), SCHED_RR, &param);

    atomic_fetch_add(error ? &n_refused : &n_raised, 1);
    return -error;
}

void
realtime_get_counts(int *raised, int *refused)
{
    *raised = atomic_load(&n_raised);
    *refused = atomic_load(&n_refused);
}
