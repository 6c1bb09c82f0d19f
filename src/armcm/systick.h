/* SPDX-License-Identifier: GPL-3.0-or-later
 * SysTick as the alarm of timers (armcm/alarm.h).
 */
#ifndef ARMCM_SYSTICK_H
#define ARMCM_SYSTICK_H

#include "armcm/core.h"
#include "port.h"

/* More than a load, to read the clock; a port may know */
#ifndef PORT_CLOCK_TICKS
#define PORT_CLOCK_TICKS 0
#endif

#define ENTRY_TICKS (32 + PORT_CLOCK_TICKS)
/* Between two looks at the clock an event comes nearer than it seemed */
#define NEAR_TICKS (ENTRY_TICKS + 48 + 2 * PORT_CLOCK_TICKS)
#define LEAD_TICKS 16
#define REACH_BITS 23

static inline void alarm_begin(void)
{
}

/* Interrupt ENTRY_TICKS before `clock`, which is `ahead` ticks away: more than
 * those, within reach.  (Any value clears CVR.) */
static inline void alarm_set(uint32_t clock, uint32_t ahead)
{
    (void)clock;
    SYSTICK->RVR = ahead - ENTRY_TICKS;
    SYSTICK->CVR = ahead - ENTRY_TICKS;
}

#endif
