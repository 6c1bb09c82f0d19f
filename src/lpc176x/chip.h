/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the peripherals of the LPC176x share.
 */
#ifndef LPC176X_CHIP_H
#define LPC176X_CHIP_H

#include <stdint.h>
#include "lpc176x/periph.h"

/* Number of a pin: GPIO(0, 3) is P0.3 */
#define GPIO(PORT, BIT) ((PORT) * 32 + (BIT))

#define LPC_JOIN_(A, B, C) A##B##C
#define LPC_JOIN(A, B, C) LPC_JOIN_(A, B, C)

/* Task: give the peripheral of a bit of PCONP its clock. */
void chip_enable(uint32_t power_bit);

/* Task: connect `pin` to a peripheral, by the number of the function; `pull` is
 * as in gpio_float(). */
#define GPIO_OPEN_DRAIN 0x80
void gpio_alternate(uint32_t pin, uint8_t function, int8_t pull);

#endif
