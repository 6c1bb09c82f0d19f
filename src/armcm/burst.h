/* SPDX-License-Identifier: GPL-3.0-or-later
 * Limits of a timer interrupt's run of events, in ticks.
 */
#ifndef ARMCM_BURST_H
#define ARMCM_BURST_H

#define US_TICKS (CONFIG_CLOCK_FREQ / 1000000)
/* Tasks get a moment after this much of nothing but events */
#define BURST_TICKS (100 * US_TICKS)
#define PAUSE_TICKS ((CONFIG_CLOCK_FREQ > 144000000 ? 5 : 10) * US_TICKS)
#define LATE_TICKS (1000 * US_TICKS)

#endif
