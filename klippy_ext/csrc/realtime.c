/* SPDX-License-Identifier: GPL-3.0-or-later
 * See realtime.h. */
#define _GNU_SOURCE
#include <errno.h>
#include <linux/capability.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

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

static int
has_capability(int capability)
{
    struct __user_cap_header_struct head = {
        .version = _LINUX_CAPABILITY_VERSION_3,
    };
    struct __user_cap_data_struct data[_LINUX_CAPABILITY_U32S_3] = { 0 };

    if (syscall(SYS_capget, &head, data))
        return 0;
    return data[capability / 32].effective >> (capability % 32) & 1;
}

int
realtime_lock_memory(void)
{
    struct rlimit limit;

    if (getrlimit(RLIMIT_MEMLOCK, &limit))
        return -errno;
    if (limit.rlim_cur != RLIM_INFINITY && !has_capability(CAP_IPC_LOCK))
        return -EPERM;
    /* Only what is touched: stacks of threads are mostly not */
    if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT))
        return -errno;
    return 0;
}
