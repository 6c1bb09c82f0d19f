/* SPDX-License-Identifier: GPL-3.0-or-later
 * Threads of ordinary priority, for files of the kernel that take long to read.
 */
#ifndef LINUX_WORKER_H
#define LINUX_WORKER_H

/* Start `run` on a thread that takes no signals and no priority from this one.
 * 0 or a negative errno. */
int worker_start(void *(*run)(void *unused));

#endif
