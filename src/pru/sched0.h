/* SPDX-License-Identifier: GPL-3.0-or-later
 * PRU0's main loop has these beside the functions of core/sched.h.
 */
#ifndef PRU_SCHED0_H
#define PRU_SCHED0_H

#include <stdbool.h>

/* Run the timer if it is due. */
void sched0_run_timer(void);

/* Each pass: is there anything to do, for either core? */
void sched0_note(bool is_busy);

#endif
