/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a port with CONFIG_ARMCM_BOOT_REQUEST provides for the start. */
#ifndef ARMCM_BOOT_H
#define ARMCM_BOOT_H

/* Irqs off, clocks as after a reset, variables not yet initialised: was the
 * chip reset to start a boot loader?  Then it does not return. */
void board_check_boot_request(void);

#endif
