/* SPDX-License-Identifier: GPL-3.0-or-later
 * Handles of the RP2040 and RP2350, and what must inline.
 */
#ifndef RP2040_PORT_H
#define RP2040_PORT_H

#include <stdbool.h>
#include <stdint.h>
#include "armcm/cpu.h"

#if CONFIG_MACH_RP2350
#include "rp2040/rp2350.h"
#define SYS_MHZ 150
#define N_PINS 48
#else
#include "rp2040/rp2040.h"
#define SYS_MHZ 125
#define N_PINS 30
#define TIMER ((struct timer_regs *)TIMER_BASE)

static ALWAYS_INLINE uint32_t timer_read_clock(void)
{
    return TIMER->TIMERAWL;
}

/* Timers count the crystal; SysTick runs all the time: pauses are counted in
 * the processor's cycles, ten of which are a tick. */
static inline __attribute__((always_inline)) void port_delay(uint32_t ticks)
{
    uint32_t start = SYSTICK->CVR;
    uint32_t cycles = (ticks * (SYS_MHZ * 1024 / 12 + 1)) >> 10;

    while (((start - SYSTICK->CVR) & SYSTICK_MAX) < cycles)
        ;
}
#define PORT_DELAY_TICKS(TICKS) port_delay(TICKS)
#endif

#define SIO ((struct sio_regs *)SIO_BASE)

/* Pins from 32 on have registers of their own */
#if CONFIG_MACH_RP2350
struct gpio_out { struct sio_regs *regs; uint32_t bit; };
struct gpio_in { struct sio_regs *regs; uint32_t bit; };
#define PIN_REGS(PIN) ((PIN).regs)
#else
struct gpio_out { uint32_t bit; };
struct gpio_in { uint32_t bit; };
#define PIN_REGS(PIN) SIO
#endif
struct gpio_adc { uint8_t channel; };
struct gpio_pwm { volatile uint32_t *compares; uint32_t period, shift; };
struct spi_config { struct spi_regs *regs; uint32_t cr0, prescaler; };
struct i2c_config { struct i2c_regs *regs; uint32_t period; uint8_t addr; };

static inline void gpio_write(struct gpio_out out, uint8_t level)
{
    if (level)
        PIN_REGS(out)->OUT_SET = out.bit;
    else
        PIN_REGS(out)->OUT_CLR = out.bit;
}

static ALWAYS_INLINE void gpio_toggle_irq(struct gpio_out out)
{
    PIN_REGS(out)->OUT_XOR = out.bit;
}

static inline void gpio_toggle(struct gpio_out out)
{
    PIN_REGS(out)->OUT_XOR = out.bit;
}

static inline uint8_t gpio_read(struct gpio_in in)
{
    return !!(PIN_REGS(in)->IN & in.bit);
}

#endif
