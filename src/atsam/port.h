/* SPDX-License-Identifier: GPL-3.0-or-later
 * Handles of the SAM3X, SAM4 and SAM E70, and what must inline.
 */
#ifndef ATSAM_PORT_H
#define ATSAM_PORT_H

#include <stdbool.h>
#include <stdint.h>
#include "armcm/cpu.h"
#include "atsam/periph.h"

struct gpio_out { struct pio_regs *regs; uint32_t bit; };
struct gpio_in { struct pio_regs *regs; uint32_t bit; };
struct gpio_adc { uint8_t channel, unit; };
struct gpio_pwm { volatile uint32_t *duty; uint32_t period; };
struct spi_config { void *regs; uint32_t mode, divider; bool is_usart; };
struct i2c_config { struct twi_regs *regs; uint8_t addr; };

static inline void gpio_write(struct gpio_out out, uint8_t level)
{
    if (level)
        out.regs->SODR = out.bit;
    else
        out.regs->CODR = out.bit;
}

/* What is written to ODSR counts for outputs only (OWER). */
static ALWAYS_INLINE void gpio_toggle_irq(struct gpio_out out)
{
    out.regs->ODSR ^= out.bit;
}

static inline void gpio_toggle(struct gpio_out out)
{
    irq_flag_t flag = irq_save();

    gpio_toggle_irq(out);
    irq_restore(flag);
}

static inline uint8_t gpio_read(struct gpio_in in)
{
    return !!(in.regs->PDSR & in.bit);
}

#endif
