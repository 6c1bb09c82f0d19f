/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * One lock for planned motion and its steps: whoever plans, asks or makes
 * steps holds it for as long as one call takes.  Only the thread of a
 * stepguard ever competes with the main thread for it.  What the threads of a
 * steppool have begun is finished first.
 */
#ifndef MOTIONLOCK_H
#define MOTIONLOCK_H

#include <pthread.h>

#include "steppool.h"

extern pthread_mutex_t motionlock;

static inline void
motionlock_take(void)
{
    steppool_settle();
    pthread_mutex_lock(&motionlock);
}

static inline void
motionlock_give(void)
{
    pthread_mutex_unlock(&motionlock);
}

#endif
