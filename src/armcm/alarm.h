/* SPDX-License-Identifier: GPL-3.0-or-later
 * What interrupts when a timer is due: from events.c to systick.c, or to the
 * timer.c of a port that has one.
 *
 * The port's alarm (systick.h, port_alarm.h) gives, in ticks:
 *   ENTRY_TICKS  interrupts come this much early: what it takes to get to the
 *                events
 *   NEAR_TICKS   an event this near is waited for
 *   LEAD_TICKS   from a look at the clock to what an event does
 *   REACH_BITS   the alarm can be set so many bits of ticks ahead, and
 * alarm_set(), alarm_pause() and alarm_begin().
 */
#ifndef ARMCM_ALARM_H
#define ARMCM_ALARM_H

#include <stdint.h>

#if CONFIG_ARMCM_OWN_TIMER
#include "port_alarm.h"
#else
#include "armcm/systick.h"
#endif

/* The handler to connect to the alarm's interrupt. */
void armcm_timer_irq(void);

#endif
