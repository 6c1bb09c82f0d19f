/* SPDX-License-Identifier: GPL-3.0-or-later
 * Handles of the LPC176x, and what must inline.
 */
#ifndef LPC176X_PORT_H
#define LPC176X_PORT_H

#include <stdint.h>
#include "armcm/cpu.h"
#include "lpc176x/periph.h"

/* Kinds of endpoints are fixed: 2 is for bulk data, both ways, 3 is not. */
#define USB_EP_IN_NUMBER 2

struct gpio_out { struct gpio_regs *regs; uint32_t bit; };
struct gpio_in { struct gpio_regs *regs; uint32_t bit; };
struct gpio_adc { uint8_t channel; };
struct gpio_pwm { volatile uint32_t *match; uint32_t latch; };
struct spi_config { struct ssp_regs *regs; uint32_t cr0, prescaler; };
struct i2c_config { struct i2c_regs *regs; uint8_t addr; };

static inline void gpio_write(struct gpio_out out, uint8_t level)
{
    if (level)
        out.regs->SET = out.bit;
    else
        out.regs->CLR = out.bit;
}

/* PIN sets all outputs of the port; they are as SET tells. */
static ALWAYS_INLINE void gpio_toggle_irq(struct gpio_out out)
{
    out.regs->PIN = out.regs->SET ^ out.bit;
}

static inline void gpio_toggle(struct gpio_out out)
{
    irq_flag_t flag = irq_save();

    gpio_toggle_irq(out);
    irq_restore(flag);
}

static inline uint8_t gpio_read(struct gpio_in in)
{
    return !!(in.regs->PIN & in.bit);
}

#endif
