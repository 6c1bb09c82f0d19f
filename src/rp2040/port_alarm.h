/* SPDX-License-Identifier: GPL-3.0-or-later
 * Alarm 0 of the RP2040's timer (armcm/alarm.h; data sheet, 4.6).
 */
#ifndef RP2040_PORT_ALARM_H
#define RP2040_PORT_ALARM_H

#include "port.h"

#define ENTRY_TICKS 3
#define NEAR_TICKS (ENTRY_TICKS + 5)
#define LEAD_TICKS 1
#define REACH_BITS 31

/* In the interrupt, before the alarm is set anew. */
static inline void alarm_begin(void)
{
    TIMER->INTR = 1;
    TIMER->INTF = 0;
}

/* Interrupt ENTRY_TICKS before `clock`, which is `ahead` ticks away.  The flag
 * of the last alarm is taken back; one that was forced makes a second
 * interrupt, which finds nothing due. */
static inline void alarm_set(uint32_t clock, uint32_t ahead)
{
    (void)ahead;
    TIMER->INTR = 1;
    TIMER->ALARM[0] = clock - ENTRY_TICKS;
}

#endif
