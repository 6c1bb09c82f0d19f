/* SPDX-License-Identifier: GPL-3.0-or-later
 * Handles of the SAM C and D chips, and what must inline.
 */
#ifndef ATSAMD_PORT_H
#define ATSAMD_PORT_H

#include <stdint.h>
#include "armcm/cpu.h"

#if CONFIG_MACH_SAMD21
#include "atsamd/d21.h"
#elif CONFIG_MACH_SAMC21
#include "atsamd/c21.h"
#else
#include "atsamd/d51.h"
#endif

#if CONFIG_MACH_SAMD21
/* It is copied to the bus again and again: a few cycles old. */
static ALWAYS_INLINE uint32_t timer_read_clock(void)
{
    return TC_COUNT;
}
#elif CONFIG_MACH_SAMC21
/* It is copied to the bus on request.  An interrupt in between does so, too. */
#define PORT_CLOCK_TICKS 16
static ALWAYS_INLINE uint32_t timer_read_clock(void)
{
    TC_CTRLBSET = TC_CTRLBSET_READSYNC;
    while (TC_CTRLBSET & TC_CTRLBSET_READSYNC)
        ;
    while (TC_SYNCBUSY)
        ;
    return TC_COUNT;
}
#endif

struct gpio_out { struct port_regs *regs; uint32_t bit; };
struct gpio_in { struct port_regs *regs; uint32_t bit; };
struct gpio_adc { struct adc_regs *regs; uint8_t channel; };
struct gpio_pwm { struct tcc_regs *regs; uint32_t period; uint8_t channel; };
struct spi_config { struct sercom_regs *regs; uint32_t ctrla; uint8_t baud; };
struct i2c_config { struct sercom_regs *regs; uint8_t addr; };

/* Ports again, where the processor does not wait */
static inline struct port_regs *gpio_fast(struct port_regs *regs)
{
    return (struct port_regs *)((uintptr_t)regs - PORT_BASE + PORT_FAST_BASE);
}

static inline void gpio_write(struct gpio_out out, uint8_t level)
{
    if (level)
        out.regs->OUTSET = out.bit;
    else
        out.regs->OUTCLR = out.bit;
}

static ALWAYS_INLINE void gpio_toggle_irq(struct gpio_out out)
{
    out.regs->OUTTGL = out.bit;
}

static inline void gpio_toggle(struct gpio_out out)
{
    out.regs->OUTTGL = out.bit;
}

static inline uint8_t gpio_read(struct gpio_in in)
{
    return !!(in.regs->IN & in.bit);
}

#endif
