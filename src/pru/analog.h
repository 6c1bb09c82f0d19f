/* SPDX-License-Identifier: GPL-3.0-or-later
 * PRU0: reads the analog inputs for PRU1.
 */
#ifndef PRU_ANALOG_H
#define PRU_ANALOG_H

#include "mailbox.h"

/* Pass on what has been converted, once anybody wants it. */
void analog_poll(struct mailbox *box);

#endif
