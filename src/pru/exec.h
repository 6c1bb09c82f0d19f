/* SPDX-License-Identifier: GPL-3.0-or-later
 * PRU1's side of the mailbox.
 */
#ifndef PRU_EXEC_H
#define PRU_EXEC_H

#include "mailbox.h"

#define BOX ((struct mailbox *)MAILBOX_ADDR)

/* Any context: wake the task that runs commands if there are any. */
void exec_poll(void);

#endif
