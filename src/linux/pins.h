/* SPDX-License-Identifier: GPL-3.0-or-later
 * Numbers of the pins of a linux process: lines of gpio chips, channels of pwm
 * chips, analog inputs, one after the other.
 */
#ifndef LINUX_PINS_H
#define LINUX_PINS_H

#define PINS_GPIO_LINES 512 /* a chip */
#define PINS_GPIO_CHIPS 9
#define PINS_GPIO(CHIP) ((CHIP) * PINS_GPIO_LINES)

#define PINS_PWM_CHANNELS 16 /* a chip */
#define PINS_PWM_CHIPS 8
#define PINS_PWM(CHIP) (0x1800 + (CHIP) * PINS_PWM_CHANNELS)

#define PINS_ANALOG 0x1900
#define PINS_ANALOG_INPUTS 8

#define PINS_END 0x1a00

#endif
