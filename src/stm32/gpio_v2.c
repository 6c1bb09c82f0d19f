/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a pin does, on all STM32 but the F1 (RM0090, 8.3). */
#include "chip.h"
#include "gpio_mode.h"

/* PUPDR */
#define PULL_UP 1u
#define PULL_DOWN 2u
/* OSPEEDR: second of four; fast enough for 10 MHz */
#define SPEED_MEDIUM 1u

static void set_field(volatile uint32_t *reg, uint32_t shift, uint32_t mask,
                      uint32_t value)
{
    *reg = (*reg & ~(mask << shift)) | value << shift;
}

void gpio_set_mode(gpio_regs_t *regs, uint32_t bit, enum gpio_mode mode,
                   int8_t pull, uint8_t function)
{
    uint32_t index = (uint32_t)__builtin_ctz(bit);
    uint32_t pull_bits = pull > 0 ? PULL_UP : pull < 0 ? PULL_DOWN : 0;

    set_field(&regs->AFR[index / 8], 4 * (index % 8), 0xf,
              function & 0xf);
    set_field(&regs->PUPDR, 2 * index, 3, pull_bits);
    set_field(&regs->OSPEEDR, 2 * index, 3, SPEED_MEDIUM);
    if (mode == GPIO_MODE_ALTERNATE && function & GPIO_OPEN_DRAIN)
        regs->OTYPER |= bit;
    else
        regs->OTYPER &= ~bit;
    set_field(&regs->MODER, 2 * index, 3, mode);
}
