/* SPDX-License-Identifier: GPL-3.0-or-later
 * Board contract: the watchdog, for a chip with HAVE_WATCHDOG.
 *
 * A port starts it in an init function with a time of 250 ms to 1 s; from then
 * on the core keeps it quiet as long as both timers and tasks run.
 */
#ifndef BOARD_WATCHDOG_H
#define BOARD_WATCHDOG_H

/* Task: the chip resets unless this is called again in time. */
void watchdog_pet(void);

#endif
