/* SPDX-License-Identifier: GPL-3.0-or-later
 * STM32G4 and L4: RM0440, 2.2 (addresses), 3.7 (flash access), 6.4 (PWR), 7.4
 * (RCC), 14.3 (interrupts), 21.7 (converter); RM0394 for the L412.
 */
#ifndef STM32_G4L4_H
#define STM32_G4L4_H

#include "stm32/periph.h"

struct rcc_regs {
    volatile uint32_t CR, ICSCR, CFGR, PLLCFGR, reserved0[2], CIER, CIFR, CICR;
    volatile uint32_t reserved1, AHB1RSTR, AHB2RSTR, AHB3RSTR, reserved2;
    volatile uint32_t APB1RSTR1, APB1RSTR2, APB2RSTR, reserved3, AHB1ENR;
    volatile uint32_t AHB2ENR, AHB3ENR, reserved4, APB1ENR1, APB1ENR2, APB2ENR;
};
#define RCC_BASE 0x40021000
#define RCC_CR_MSION (1u << 0)      /* L4 */
#define RCC_CR_HSION (1u << 8)
#define RCC_CR_HSIRDY (1u << 10)
#define RCC_CR_HSEON (1u << 16)
#define RCC_CR_HSERDY (1u << 17)
#define RCC_CR_PLLON (1u << 24)
#define RCC_CR_PLLRDY (1u << 25)
#define RCC_CFGR_SW_HSI 1u
#define RCC_CFGR_SW_PLL 3u
#define RCC_CFGR_SWS (3u << 2)
#define RCC_CFGR_SWS_HSI (1u << 2)
#define RCC_CFGR_SWS_PLL (3u << 2)
#define RCC_CFGR_HPRE_2 (8u << 4)
#define RCC_PLLCFGR_SRC_HSI 2u
#define RCC_PLLCFGR_SRC_HSE 3u
#define RCC_PLLCFGR_M(M) (((M) - 1u) << 4)
#define RCC_PLLCFGR_N(N) ((N) << 8)
#define RCC_PLLCFGR_R2 (1u << 24)   /* enabled, divided by two */
#define RCC_CCIPR (*(volatile uint32_t *)(RCC_BASE + 0x88))
#define RCC_CCIPR_CLK48 (3u << 26)      /* 0: the oscillator of 48 MHz */
#define RCC_CCIPR_FDCAN (3u << 24)      /* G4 */
#define RCC_CCIPR_FDCAN_PCLK (2u << 24)
#define RCC_CRRCR (*(volatile uint32_t *)(RCC_BASE + 0x98))
#define RCC_CRRCR_HSI48ON (1u << 0)
#define RCC_CRRCR_HSI48RDY (1u << 1)
#define RCC_GATE_AHB2(BIT) STM32_GATE(0x4c, BIT)
#define RCC_GATE_APB1(BIT) STM32_GATE(0x58, BIT)
#define RCC_GATE_APB2(BIT) STM32_GATE(0x60, BIT)

#define PWR_GATE RCC_GATE_APB1(28)
#define PWR_CR5 (*(volatile uint32_t *)0x40007080)  /* G4 */
#define PWR_CR5_NO_BOOST (1u << 8)

#define FLASH_ACR (*(volatile uint32_t *)0x40022000)
#define FLASH_ACR_LATENCY 15u
#define FLASH_ACR_PRFTEN (1u << 8)
#define FLASH_ACR_ICEN (1u << 9)
#define FLASH_ACR_DCEN (1u << 10)

#define GPIO_BASE 0x48000000
#define GPIO_GATE(PORT) RCC_GATE_AHB2(PORT)

#define USART1_BASE 0x40013800
#define USART1_GATE RCC_GATE_APB2(14)
#define USART1_IRQ 37
#define USART2_BASE 0x40004400
#define USART2_GATE RCC_GATE_APB1(17)
#define USART2_IRQ 38
#define USART3_BASE 0x40004800
#define USART3_GATE RCC_GATE_APB1(18)
#define USART3_IRQ 39

#define SPI1_BASE 0x40013000
#define SPI1_GATE RCC_GATE_APB2(12)
#define SPI2_BASE 0x40003800
#define SPI2_GATE RCC_GATE_APB1(14)
#define SPI3_BASE 0x40003c00
#define SPI3_GATE RCC_GATE_APB1(15)

#define I2C1_BASE 0x40005400
#define I2C1_GATE RCC_GATE_APB1(21)
#define I2C2_BASE 0x40005800
#define I2C2_GATE RCC_GATE_APB1(22)
#if CONFIG_MACH_STM32L4
#define I2C3_BASE 0x40005c00
#define I2C3_GATE RCC_GATE_APB1(23)
#else
#define I2C3_BASE 0x40007800
#define I2C3_GATE RCC_GATE_APB1(30)
#endif

#if CONFIG_MACH_STM32L4
#define ADC1_BASE 0x50040000
#else
#define ADC1_BASE 0x50000000
#endif
#define ADC2_BASE (ADC1_BASE + 0x100)
#define ADC1_GATE RCC_GATE_AHB2(13)
#define ADC_COMMON_CCR (*(volatile uint32_t *)(ADC1_BASE + 0x308))

#define TIM1_BASE 0x40012c00
#define TIM1_GATE RCC_GATE_APB2(11)
#define TIM2_BASE 0x40000000
#define TIM2_GATE RCC_GATE_APB1(0)
#define TIM3_BASE 0x40000400
#define TIM3_GATE RCC_GATE_APB1(1)
#define TIM4_BASE 0x40000800
#define TIM4_GATE RCC_GATE_APB1(2)
#define TIM15_BASE 0x40014000
#define TIM15_GATE RCC_GATE_APB2(16)
#define TIM16_BASE 0x40014400
#define TIM16_GATE RCC_GATE_APB2(17)
#define TIM17_BASE 0x40014800
#define TIM17_GATE RCC_GATE_APB2(18)

#define IWDG_BASE 0x40003000

#if CONFIG_MACH_STM32L4
#define USB_BASE 0x40006800
#define USB_GATE RCC_GATE_APB1(26)
#define USB_IRQ 67
#define USB_PMA 0x40006c00
#define CRS_BASE 0x40006000
#define CRS_GATE RCC_GATE_APB1(24)
#define PWR_CR2 (*(volatile uint32_t *)0x40007004)
#define PWR_CR2_USV (1u << 10)          /* VDDUSB is there */
#else
#define USB_BASE 0x40005c00
#define USB_GATE RCC_GATE_APB1(23)
#define USB_IRQ 20                      /* of low priority */
#define USB_PMA 0x40006000
#define CRS_BASE 0x40002000
#define CRS_GATE RCC_GATE_APB1(8)
#define FDCAN1_BASE 0x40006400
#define FDCAN2_BASE 0x40006800
#define FDCAN_GATE RCC_GATE_APB1(25)
#define FDCAN1_IRQ 21
#define FDCAN2_IRQ 86
#define FDCAN_RAM 0x4000a400
#endif

#define UID_ADDR 0x1fff7590

#endif
