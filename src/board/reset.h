/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: reset and watchdog.
 */
#ifndef BOARD_RESET_H
#define BOARD_RESET_H

#include "port.h"

/* --- The port provides --- */

/* Task: restart the mcu; returns at most until the reset takes effect.  Used
 * by the `reset` command (built where CONFIG_HAVE_RESET). */
void reset_mcu(void);

/* Task: start the boot loader, which takes new firmware; a reset where there is
 * none that can be asked (built where CONFIG_HAVE_BOOTLOADER_REQUEST). */
void reset_to_bootloader(void);

/* A watchdog, where there is one, is the port's own: DECL_INIT starts it (about
 * 500 ms), a DECL_TASK feeds it. */

#endif
