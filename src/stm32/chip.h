/* SPDX-License-Identifier: GPL-3.0-or-later
 * The chip that is built for, and what its peripherals share.
 */
#ifndef STM32_CHIP_H
#define STM32_CHIP_H

#include <stdint.h>

#if CONFIG_MACH_STM32F1
#include "stm32/f1.h"
#elif CONFIG_STM32_F2F4F7
#include "stm32/f2f4f7.h"
#elif CONFIG_MACH_STM32F0
#include "stm32/f0.h"
#elif CONFIG_MACH_STM32G0
#include "stm32/g0.h"
#elif CONFIG_MACH_STM32G4 || CONFIG_MACH_STM32L4
#include "stm32/g4l4.h"
#elif CONFIG_MACH_STM32H7
#include "stm32/h7.h"
#endif

#define RCC ((struct rcc_regs *)RCC_BASE)

/* Number of a pin: GPIO('A', 3) */
#define GPIO(LETTER, BIT) (((LETTER) - 'A') * 16 + (BIT))
#define GPIO_NONE 0xff

#define PIN_ADC_TEMPERATURE 0xfe

#define STM32_JOIN_(A, B, C) A##B##C
#define STM32_JOIN(A, B, C) STM32_JOIN_(A, B, C)

/* Task: give a peripheral its clock; it may be used at once. */
void chip_enable(uint32_t gate);

/* Task: connect `pin` to a peripheral.  `function` is the number of the
 * alternate function where there are such, and GPIO_OPEN_DRAIN; `pull` is as
 * in gpio_float(). */
#define GPIO_OPEN_DRAIN 0x80
void gpio_alternate(uint32_t pin, uint8_t function, int8_t pull);

/* Task: connect `pin` to the converter. */
void gpio_analog(uint32_t pin);

/* Task, F1 only: set a field of AFIO_MAPR. */
void gpio_remap(uint32_t mask, uint32_t value);

#endif
