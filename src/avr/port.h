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
#include <stdbool.h>
#include <stdint.h>
#include "delay.h"

#define ROM __flash
#define USB_EP0_SIZE 16

/* Pins are numbered through all ports, whether a chip has them or not. */
#define PIN_NUMBER(LETTER, BIT) (((LETTER) - 'A') * 8 + (BIT))

typedef uint8_t irq_flag_t;

struct gpio_out { volatile uint8_t *port; uint8_t bit; };
struct gpio_in { volatile uint8_t *port; uint8_t bit; };
struct gpio_adc { uint8_t channel; };
struct gpio_pwm { uint8_t channel; };
struct spi_config { uint8_t spcr, spsr; };
struct i2c_config { uint8_t addr, twbr; };

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

/* A comparison needs no registers for the difference. */
#define PORT_HAS_TIMER_IS_BEFORE
static inline bool timer_is_before(uint32_t a, uint32_t b)
{
    __asm__ goto("cp %A0, %A1\n\tcpc %B0, %B1\n\tcpc %C0, %C1\n\t"
                 "cpc %D0, %D1\n\tbrpl .+2\n\trjmp %l[yes]"
                 : : "r"(a), "r"(b) : "cc" : yes);
    return false;
yes:
    return true;
}

/* Through the list of timers, which begin with `next` and have `waketime` at 4:
 * a third less time than the compiler's code. */
#define PORT_HAS_SEEK_TIMER
static inline void *port_seek_timer(void *other, uint32_t clock,
                                    const void *sentinel)
{
    void *found;

    __asm__ volatile(
        "1: movw %[found], r30\n\t"
        "ld __tmp_reg__, Z\n\tldd r31, Z+1\n\tmov r30, __tmp_reg__\n\t"
        "cp r30, %A[sentinel]\n\tcpc r31, %B[sentinel]\n\tbreq 2f\n\t"
        "ldd __tmp_reg__, Z+4\n\tcp %A[clock], __tmp_reg__\n\t"
        "ldd __tmp_reg__, Z+5\n\tcpc %B[clock], __tmp_reg__\n\t"
        "ldd __tmp_reg__, Z+6\n\tcpc %C[clock], __tmp_reg__\n\t"
        "ldd __tmp_reg__, Z+7\n\tcpc %D[clock], __tmp_reg__\n\t"
        "brpl 1b\n2:"
        : [found] "=&r"(found), "+z"(other)
        : [clock] "r"(clock), [sentinel] "r"(sentinel) : "cc", "memory");
    return found;
}

static inline void gpio_toggle(struct gpio_out out)
{
    out.port[0] = out.bit;
}

/* By way of X: Z and Y are for what has more than one field. */
static inline void gpio_toggle_irq(struct gpio_out out)
{
    __asm__ volatile("st %a0, %1" : : "x"(out.port), "r"(out.bit) : "memory");
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
