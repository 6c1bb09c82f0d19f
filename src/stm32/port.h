/* SPDX-License-Identifier: GPL-3.0-or-later
 * Handles of the STM32, and what must inline.
 */
#ifndef STM32_PORT_H
#define STM32_PORT_H

#include <stdint.h>
#include "armcm/cpu.h"
#include "stm32/periph.h"

#if CONFIG_STM32_GPIO_V2
typedef struct gpio_v2_regs gpio_regs_t;
#else
typedef struct gpio_v1_regs gpio_regs_t;
#endif

#if CONFIG_STM32_CLOCK_CHAINED
/* Two counters of 16 bits: TIM3 and TIM1, one address for all chips that need
 * them.  The upper one follows an overflow of the lower a few cycles later. */
#define PORT_CLOCK_TICKS 32
static ALWAYS_INLINE uint32_t timer_read_clock(void)
{
    uint32_t low, high;

    do {
        low = ((struct tim_regs *)0x40000400)->CNT;
        high = ((struct tim_regs *)0x40012c00)->CNT;
    } while (low - 8 >= 0xffe8);
    return high << 16 | low;
}
#elif CONFIG_STM32_CLOCK_TIM2
static ALWAYS_INLINE uint32_t timer_read_clock(void)
{
    return ((struct tim_regs *)0x40000000)->CNT;
}
#endif

#if CONFIG_MACH_STM32H7
typedef struct spi_v2_regs spi_regs_t;
#else
typedef struct spi_v1_regs spi_regs_t;
#endif
#if CONFIG_STM32_I2C_V1
typedef struct i2c_v1_regs i2c_regs_t;
#else
typedef struct i2c_v2_regs i2c_regs_t;
#endif
struct i2c_config { i2c_regs_t *regs; uint8_t addr; };
struct spi_config { spi_regs_t *regs; uint32_t first, second; };

struct gpio_out { gpio_regs_t *regs; uint32_t bit; };
struct gpio_in { gpio_regs_t *regs; uint32_t bit; };
struct gpio_adc { uint8_t channel, unit; };
struct gpio_pwm { volatile uint32_t *compare; uint32_t period; };

static inline void gpio_write(struct gpio_out out, uint8_t level)
{
    out.regs->BSRR = level ? out.bit : out.bit << 16;
}

static ALWAYS_INLINE void gpio_toggle_irq(struct gpio_out out)
{
    out.regs->ODR ^= out.bit;
}

static inline void gpio_toggle(struct gpio_out out)
{
    irq_flag_t flag = irq_save();

    gpio_toggle_irq(out);
    irq_restore(flag);
}

static inline uint8_t gpio_read(struct gpio_in in)
{
    return !!(in.regs->IDR & in.bit);
}

#endif
