/* SPDX-License-Identifier: GPL-3.0-or-later
 * STM32F0: RM0091, 2.2 (addresses), 3.5 (flash access), 6.4 (RCC), 9.1
 * (SYSCFG), 11.1.3 (interrupts), 13.12 (converter); RM0360 for the F0x0.
 */
#ifndef STM32_F0_H
#define STM32_F0_H

#include "stm32/periph.h"

struct rcc_regs {
    volatile uint32_t CR, CFGR, CIR, APB2RSTR, APB1RSTR, AHBENR, APB2ENR;
    volatile uint32_t APB1ENR, BDCR, CSR, AHBRSTR, CFGR2, CFGR3, CR2;
};
#define RCC_BASE 0x40021000
#define RCC_CR_HSION (1u << 0)
#define RCC_CR_HSIRDY (1u << 1)
#define RCC_CR_HSEON (1u << 16)
#define RCC_CR_HSERDY (1u << 17)
#define RCC_CR_PLLON (1u << 24)
#define RCC_CR_PLLRDY (1u << 25)
#define RCC_CFGR_SW_PLL 2u
#define RCC_CFGR_SWS (3u << 2)
#define RCC_CFGR_SWS_PLL (2u << 2)
#define RCC_CFGR_PLLSRC_HSE (1u << 16)
#define RCC_CFGR_PLLMUL(N) (((N) - 2u) << 18)
#define RCC_CFGR2_PREDIV(N) ((N) - 1u)
#define RCC_CFGR3_I2C1_SYSCLK (1u << 4)
#define RCC_CFGR3_USB_PLL (1u << 7)
#define RCC_CR2_HSI48ON (1u << 16)
#define RCC_CR2_HSI48RDY (1u << 17)
#define RCC_GATE_AHB(BIT) STM32_GATE(0x14, BIT)
#define RCC_GATE_APB2(BIT) STM32_GATE(0x18, BIT)
#define RCC_GATE_APB1(BIT) STM32_GATE(0x1c, BIT)

#define FLASH_ACR (*(volatile uint32_t *)0x40022000)
#define FLASH_ACR_PRFTBE (1u << 4)

#define SYSCFG_CFGR1 (*(volatile uint32_t *)0x40010000)
#define SYSCFG_CFGR1_MEM_RAM 3u
#define SYSCFG_CFGR1_MEM_SYSTEM 1u
#define SYSCFG_CFGR1_PA11_PA12 (1u << 4)
#define SYSCFG_GATE RCC_GATE_APB2(0)

#define GPIO_BASE 0x48000000
#define GPIO_GATE(PORT) RCC_GATE_AHB(17 + (PORT))

#define USART1_BASE 0x40013800
#define USART1_GATE RCC_GATE_APB2(14)
#define USART1_IRQ 27
#define USART2_BASE 0x40004400
#define USART2_GATE RCC_GATE_APB1(17)
#define USART2_IRQ 28

#define SPI1_BASE 0x40013000
#define SPI1_GATE RCC_GATE_APB2(12)
#define SPI2_BASE 0x40003800
#define SPI2_GATE RCC_GATE_APB1(14)

#define I2C1_BASE 0x40005400
#define I2C1_GATE RCC_GATE_APB1(21)
#define I2C2_BASE 0x40005800
#define I2C2_GATE RCC_GATE_APB1(22)

#define ADC1_BASE 0x40012400
#define ADC1_GATE RCC_GATE_APB2(9)
#define ADC_COMMON_CCR (*(volatile uint32_t *)0x40012708)

#define TIM1_BASE 0x40012c00
#define TIM1_GATE RCC_GATE_APB2(11)
#define TIM2_BASE 0x40000000
#define TIM2_GATE RCC_GATE_APB1(0)
#define TIM3_BASE 0x40000400
#define TIM3_GATE RCC_GATE_APB1(1)
#define TIM14_BASE 0x40002000
#define TIM14_GATE RCC_GATE_APB1(8)
#define TIM15_BASE 0x40014000
#define TIM15_GATE RCC_GATE_APB2(16)
#define TIM16_BASE 0x40014400
#define TIM16_GATE RCC_GATE_APB2(17)
#define TIM17_BASE 0x40014800
#define TIM17_GATE RCC_GATE_APB2(18)

#define IWDG_BASE 0x40003000

#define USB_BASE 0x40005c00
#define USB_GATE RCC_GATE_APB1(23)
#define USB_IRQ 31
#define USB_PMA 0x40006000
#define CRS_BASE 0x40006c00
#define CRS_GATE RCC_GATE_APB1(27)
#define CAN_BASE 0x40006400
#define CAN_GATE RCC_GATE_APB1(25)
#define CEC_CAN_IRQ 30

#define UID_ADDR 0x1ffff7ac

#endif
