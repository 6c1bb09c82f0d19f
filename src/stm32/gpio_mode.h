/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a pin does: gpio_v1.c or gpio_v2.c.
 */
#ifndef STM32_GPIO_MODE_H
#define STM32_GPIO_MODE_H

#include <stdint.h>
#include "port.h"

/* As MODER has them */
enum gpio_mode {
    GPIO_MODE_INPUT, GPIO_MODE_OUTPUT, GPIO_MODE_ALTERNATE, GPIO_MODE_ANALOG
};

/* Irqs off.  `pull` is of inputs and alternate functions. */
void gpio_set_mode(gpio_regs_t *regs, uint32_t bit, enum gpio_mode mode,
                   int8_t pull, uint8_t function);

/* A pin that serves a debugger after reset becomes an ordinary one. */
#if CONFIG_STM32_GPIO_V2
static inline void gpio_free_debug_pin(uint32_t pin)
{
    (void)pin;
}
#else
void gpio_free_debug_pin(uint32_t pin);
#endif

#endif
