/* SPDX-License-Identifier: GPL-3.0-or-later
 * Real-time scheduling: ahead of ordinary processes, never paged out. */
#include <errno.h>
#include <sched.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include "process.h"

static int refuse(const char *what)
{
    process_log("%s is not permitted (%s). Run as root, or allow it: "
                "sudo setcap cap_sys_nice,cap_ipc_lock+ep <this program>, or "
                "in a systemd unit LimitRTPRIO=60 and LimitMEMLOCK=infinity. "
                "Without -r the process runs, but may be late",
                what, strerror(errno));
    return -1;
}

int realtime_enter(void)
{
    struct sched_param param = {
        .sched_priority = sched_get_priority_max(SCHED_FIFO) / 2,
    };

    prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
    if (!process_options.is_realtime)
        return 0;
    if (sched_setscheduler(0, SCHED_FIFO, &param))
        return refuse("Real-time scheduling");
    if (mlockall(MCL_CURRENT | MCL_FUTURE))
        return refuse("Locking memory");
    return 0;
}
