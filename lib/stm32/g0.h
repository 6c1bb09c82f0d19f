/* SPDX-License-Identifier: GPL-3.0-or-later
 * STM32G0: RM0444, 2.2 (addresses), 3.7 (flash access), 5.4 (RCC), 8.1
 * (SYSCFG), 12.3 (interrupts), 15.12 (converter); RM0454 for the G0x0.
 */
#ifndef STM32_G0_H
#define STM32_G0_H

#include "stm32/periph.h"

struct rcc_regs {
    volatile uint32_t CR, ICSCR, CFGR, PLLCFGR, reserved0, CRRCR, CIER, CIFR;
    volatile uint32_t CICR, IOPRSTR, AHBRSTR, APBRSTR1, APBRSTR2, IOPENR;
    volatile uint32_t AHBENR, APBENR1, APBENR2;
};
#define RCC_BASE 0x40021000
#define RCC_CR_HSION (1u << 8)
#define RCC_CR_HSIRDY (1u << 10)
#define RCC_CR_HSEON (1u << 16)
#define RCC_CR_HSERDY (1u << 17)
#define RCC_CR_PLLON (1u << 24)
#define RCC_CR_PLLRDY (1u << 25)
#define RCC_CFGR_SW_PLL 2u
#define RCC_CFGR_SWS (7u << 3)
#define RCC_CFGR_SWS_PLL (2u << 3)
#define RCC_PLLCFGR_SRC_HSI 2u
#define RCC_PLLCFGR_SRC_HSE 3u
#define RCC_PLLCFGR_M(M) (((M) - 1u) << 4)
#define RCC_PLLCFGR_N(N) ((N) << 8)
#define RCC_PLLCFGR_R(R) (1u << 28 | ((R) - 1u) << 29)
#define RCC_CR_HSI48ON (1u << 22)       /* G0B1 */
#define RCC_CR_HSI48RDY (1u << 23)
#define RCC_GATE_IOP(BIT) STM32_GATE(0x34, BIT)
#define RCC_GATE_APB1(BIT) STM32_GATE(0x3c, BIT)
#define RCC_GATE_APB2(BIT) STM32_GATE(0x40, BIT)

#define FLASH_ACR (*(volatile uint32_t *)0x40022000)
#define FLASH_ACR_LATENCY 7u
#define FLASH_ACR_PRFTEN (1u << 8)
#define FLASH_ACR_ICEN (1u << 9)

#define SYSCFG_CFGR1 (*(volatile uint32_t *)0x40010000)
#define SYSCFG_CFGR1_UCPD_STROBES (3u << 9)
#define SYSCFG_GATE RCC_GATE_APB2(0)

#define GPIO_BASE 0x50000000
#define GPIO_GATE(PORT) RCC_GATE_IOP(PORT)

#define USART1_BASE 0x40013800
#define USART1_GATE RCC_GATE_APB2(14)
#define USART1_IRQ 27
#define USART2_BASE 0x40004400
#define USART2_GATE RCC_GATE_APB1(17)
#define USART2_IRQ 28
#define USART3_BASE 0x40004800
#define USART3_GATE RCC_GATE_APB1(18)
#define USART3_IRQ 29

#if CONFIG_MACH_STM32G0B1
#define USART5_BASE 0x40005000
#define USART5_GATE RCC_GATE_APB1(8)
#define USART5_IRQ 29               /* with all from the third on */
#endif

#define SPI1_BASE 0x40013000
#define SPI1_GATE RCC_GATE_APB2(12)
#define SPI2_BASE 0x40003800
#define SPI2_GATE RCC_GATE_APB1(14)

#define I2C1_BASE 0x40005400
#define I2C1_GATE RCC_GATE_APB1(21)
#define I2C2_BASE 0x40005800
#define I2C2_GATE RCC_GATE_APB1(22)
#if CONFIG_MACH_STM32G0B1
#define I2C3_BASE 0x40008800
#define I2C3_GATE RCC_GATE_APB1(23)
#endif

#define ADC1_BASE 0x40012400
#define ADC1_GATE RCC_GATE_APB2(20)
#define ADC_COMMON_CCR (*(volatile uint32_t *)0x40012708)

#define TIM1_BASE 0x40012c00
#define TIM1_GATE RCC_GATE_APB2(11)
#define TIM2_BASE 0x40000000
#define TIM2_GATE RCC_GATE_APB1(0)
#define TIM3_BASE 0x40000400
#define TIM3_GATE RCC_GATE_APB1(1)
#define TIM14_BASE 0x40002000
#define TIM14_GATE RCC_GATE_APB2(15)
#define TIM15_BASE 0x40014000
#define TIM15_GATE RCC_GATE_APB2(16)
#define TIM16_BASE 0x40014400
#define TIM16_GATE RCC_GATE_APB2(17)
#define TIM17_BASE 0x40014800
#define TIM17_GATE RCC_GATE_APB2(18)

#define IWDG_BASE 0x40003000

#if CONFIG_MACH_STM32G0B1
#define USB_BASE 0x40005c00
#define USB_GATE RCC_GATE_APB1(13)
#define USB_IRQ 8
#define USB_PMA 0x40009800
#define CRS_BASE 0x40006c00
#define CRS_GATE RCC_GATE_APB1(16)
#define PWR_GATE RCC_GATE_APB1(28)
#define PWR_CR2 (*(volatile uint32_t *)0x40007004)
#define PWR_CR2_USV (1u << 10)          /* VDDUSB is there */
#define FDCAN1_BASE 0x40006400
#define FDCAN2_BASE 0x40006800
#define FDCAN_GATE RCC_GATE_APB1(12)
#define FDCAN1_IRQ 21
#define FDCAN2_IRQ 21
#define FDCAN_RAM 0x4000b400
#endif

#define UID_ADDR 0x1fff7590

#endif
