/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the two halves of sqcore share. */
#ifndef SQCORE_INTERNAL_H
#define SQCORE_INTERNAL_H

#include "sqcore.h"

/* Restart the wait for the oldest unacknowledged block. */
void sqcore__set_deadline(struct sqcore *c, double now);
/* Send all unacknowledged blocks again, behind a sync byte. */
void sqcore__resend(struct sqcore *c, double now);

#endif
