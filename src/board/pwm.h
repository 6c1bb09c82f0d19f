/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: hardware pwm.  port.h defines struct gpio_pwm.
 *
 * The port declares DECL_CONSTANT("PWM_MAX", <value that is always on>).
 */
#ifndef BOARD_PWM_H
#define BOARD_PWM_H

#include <stdint.h>
#include "port.h"

/* --- The port provides --- */

/* Task: drive `pin` with a cycle as near to `cycle_ticks` as the hardware can,
 * on for value/PWM_MAX of it.  shutdown("Not a valid PWM pin") if it has no
 * pwm, shutdown("PWM already programmed at different speed") if another
 * channel of its timer needs another cycle. */
struct gpio_pwm pwm_setup(uint32_t pin, uint32_t cycle_ticks, uint16_t value);

/* Any context, no blocking: change the duty; takes effect within a cycle. */
void pwm_write(struct gpio_pwm pwm, uint16_t value);

#endif
