/* SPDX-License-Identifier: GPL-3.0-or-later
 * Handles of the AVR, and what must inline.
 *
 * PINx, DDRx and PORTx of a port follow each other, and writing a bit to PINx
 * inverts an output: a handle is the address of PINx and the bit.
 */
#ifndef AVR_PORT_H
#define AVR_PORT_H

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>

#define ROM __flash

typedef uint8_t irq_flag_t;

struct gpio_out { volatile uint8_t *port; uint8_t bit; };
struct gpio_in { volatile uint8_t *port; uint8_t bit; };
struct gpio_adc { uint8_t channel; };
struct gpio_pwm { uint8_t channel; };

static inline void irq_disable(void)
{
    __asm__ volatile("cli" ::: "memory");
}

static inline void irq_enable(void)
{
    __asm__ volatile("sei" ::: "memory");
}

static inline irq_flag_t irq_save(void)
{
    irq_flag_t flag = SREG;

    irq_disable();
    return flag;
}

static inline void irq_restore(irq_flag_t flag)
{
    __asm__ volatile("" ::: "memory");
    SREG = flag;
}

/* What follows sei runs before any interrupt: none is slept through. */
static inline void irq_wait(void)
{
    __asm__ volatile("sei\n\tsleep\n\tcli" ::: "memory");
}

static inline void irq_poll(void)
{
}

static inline void gpio_toggle(struct gpio_out out)
{
    out.port[0] = out.bit;
}

static inline void gpio_toggle_irq(struct gpio_out out)
{
    out.port[0] = out.bit;
}

static inline void gpio_write(struct gpio_out out, uint8_t level)
{
    irq_flag_t flag = irq_save();

    if (level)
        out.port[2] |= out.bit;
    else
        out.port[2] &= (uint8_t)~out.bit;
    irq_restore(flag);
}

static inline uint8_t gpio_read(struct gpio_in in)
{
    return !!(in.port[0] & in.bit);
}

#endif
