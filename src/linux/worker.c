/* SPDX-License-Identifier: GPL-3.0-or-later
 * Threads of ordinary priority.  See worker.h. */
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stddef.h>

#include "worker.h"

int worker_start(void *(*run)(void *unused))
{
    struct sched_param param = { .sched_priority = 0 };
    pthread_attr_t attr;
    pthread_t thread;
    sigset_t all, before;
    int error;

    pthread_attr_init(&attr);
    pthread_attr_setinheritsched(&attr, PTHREAD_EXPLICIT_SCHED);
    pthread_attr_setschedpolicy(&attr, SCHED_OTHER);
    pthread_attr_setschedparam(&attr, &param);
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    error = pthread_create(&thread, &attr, run, NULL);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    pthread_attr_destroy(&attr);
    return -error;
}
