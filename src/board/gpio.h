/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: digital pins.
 *
 * `pin` is the number that the port's `pin` enumeration gives a pin name.
 * Levels are 0 or not 0.  port.h defines struct gpio_out and struct gpio_in;
 * they are copied by value, so keep them within a word or two.
 */
#ifndef BOARD_GPIO_H
#define BOARD_GPIO_H

#include <stdint.h>
#include "port.h"

/* --- The port provides --- */

/* Task: make `pin` an output at `level`, without a glitch if it already is
 * one.  shutdown("Not an output pin") if it cannot be one. */
struct gpio_out gpio_setup_output(uint32_t pin, uint8_t level);

/* Any context: drive the pin again after gpio_float() or another use. */
void gpio_drive(struct gpio_out out, uint8_t level);

/* Any context, no blocking, safe against interrupts. */
void gpio_write(struct gpio_out out, uint8_t level);

/* Invert an output: gpio_toggle() in any context, gpio_toggle_irq() in the
 * fewest instructions with irqs off. */
void gpio_toggle(struct gpio_out out);
void gpio_toggle_irq(struct gpio_out out);

/* Task: make `pin` an input; pull is -1 (down), 0 (none) or 1 (up).
 * shutdown("Not a valid input pin") if pin or pull cannot be had. */
struct gpio_in gpio_setup_input(uint32_t pin, int8_t pull);

/* Any context: an input again, with this pull, after it was driven. */
void gpio_float(struct gpio_in in, int8_t pull);

/* Any context, no blocking: 0 or 1. */
uint8_t gpio_read(struct gpio_in in);

#endif
