/* SPDX-License-Identifier: GPL-3.0-or-later
 * STM32H7: RM0433, 2.3 (addresses), 4.9 (flash access), 6.8 (PWR), 8.7 (RCC),
 * 19.1.2 (interrupts), 25.6 (converter); RM0468 for the H723.
 */
#ifndef STM32_H7_H
#define STM32_H7_H

#include "stm32/periph.h"

struct rcc_regs {
    volatile uint32_t CR, HSICFGR, CRRCR, CSICFGR, CFGR, reserved0, D1CFGR;
    volatile uint32_t D2CFGR, D3CFGR, reserved1, PLLCKSELR, PLLCFGR, PLL1DIVR;
    volatile uint32_t PLL1FRACR, reserved2[5], D1CCIPR, D2CCIP1R, D2CCIP2R;
    volatile uint32_t D3CCIPR, reserved3, CIER, CIFR, CICR, reserved4, BDCR;
    volatile uint32_t CSR, reserved5, AHB3RSTR, AHB1RSTR, AHB2RSTR, AHB4RSTR;
    volatile uint32_t APB3RSTR, APB1LRSTR, APB1HRSTR, APB2RSTR, APB4RSTR;
    volatile uint32_t reserved6[13], AHB3ENR, AHB1ENR, AHB2ENR, AHB4ENR;
    volatile uint32_t APB3ENR, APB1LENR, APB1HENR, APB2ENR, APB4ENR;
};
#define RCC_BASE 0x58024400
#define RCC_CR_HSION (1u << 0)
#define RCC_CR_HSIRDY (1u << 2)
#define RCC_CR_HSIDIV (3u << 3)
#define RCC_CR_HSEON (1u << 16)
#define RCC_CR_HSERDY (1u << 17)
#define RCC_CR_PLLON (1u << 24)
#define RCC_CR_PLLRDY (1u << 25)
#define RCC_CFGR_SW_PLL 3u
#define RCC_CFGR_SWS (7u << 3)
#define RCC_CFGR_SWS_PLL (3u << 3)
#define RCC_D1CFGR_HPRE_2 8u
#define RCC_D1CFGR_PPRE_2 (4u << 4)
#define RCC_D2CFGR_PPRES_2 (4u << 4 | 4u << 8)
#define RCC_D3CFGR_PPRE_2 (4u << 4)
#define RCC_PLLCKSELR_HSE 2u
#define RCC_PLLCKSELR_M(M) ((M) << 4)
#define RCC_PLLCFGR_RANGE_4_8 (2u << 2)
#define RCC_PLLCFGR_P_ON (1u << 16)
#define RCC_PLL1DIVR_N(N) ((N) - 1u)
#define RCC_PLL1DIVR_P(P) (((P) - 1u) << 9)
#define RCC_D3CCIPR_ADC_PER (2u << 16)
#define RCC_CR_HSI48ON (1u << 12)
#define RCC_CR_HSI48RDY (1u << 13)
#define RCC_PLLCFGR_Q_ON (1u << 17)
#define RCC_PLL1DIVR_Q(Q) (((Q) - 1u) << 16)
#define RCC_AHB1LPENR (*(volatile uint32_t *)(RCC_BASE + 0x100))
#define RCC_AHB1LPENR_ULPI (1u << 26 | 1u << 28)
#define RCC_D2CCIP2R_USB (3u << 20)
#define RCC_D2CCIP2R_USB_HSI48 (3u << 20)
#define RCC_D2CCIP1R_FDCAN (3u << 28)
#define RCC_D2CCIP1R_FDCAN_PLL1Q (1u << 28)
#define RCC_GATE_APB1H(BIT) STM32_GATE(0xec, BIT)
#define RCC_GATE_AHB1(BIT) STM32_GATE(0xd8, BIT)
#define RCC_GATE_AHB4(BIT) STM32_GATE(0xe0, BIT)
#define RCC_GATE_APB1(BIT) STM32_GATE(0xe8, BIT)
#define RCC_GATE_APB2(BIT) STM32_GATE(0xf0, BIT)
#define RCC_GATE_APB4(BIT) STM32_GATE(0xf4, BIT)
#define RCC_D2CCIP1R_SPI123_PER (4u << 12)

struct pwr_regs {
    volatile uint32_t CR1, CSR1, CR2, CR3, CPUCR, reserved0, D3CR;
};
#define PWR ((struct pwr_regs *)0x58024800)
#define PWR_CSR1_ACTVOSRDY (1u << 13)
#define PWR_CR3_LDOEN (1u << 1)
#define PWR_CR3_BYPASS (1u << 0)
#define PWR_CR3_USB33DEN (1u << 24)
#define PWR_CR3_USB33RDY (1u << 26)
#define PWR_D3CR_VOS (3u << 14)
#define PWR_D3CR_VOS_SCALE1 (3u << 14)
#define PWR_D3CR_VOS_SCALE0 0u      /* H723 */
#define PWR_D3CR_VOSRDY (1u << 13)

#define FLASH_ACR (*(volatile uint32_t *)0x52002000)
#define FLASH_ACR_WRHIGHFREQ(N) ((N) << 4)

#define GPIO_BASE 0x58020000
#define GPIO_GATE(PORT) RCC_GATE_AHB4(PORT)

#define USART1_BASE 0x40011000
#define USART1_GATE RCC_GATE_APB2(4)
#define USART1_IRQ 37
#define USART2_BASE 0x40004400
#define USART2_GATE RCC_GATE_APB1(17)
#define USART2_IRQ 38
#define USART3_BASE 0x40004800
#define USART3_GATE RCC_GATE_APB1(18)
#define USART3_IRQ 39
#define USART4_BASE 0x40004c00
#define USART4_GATE RCC_GATE_APB1(19)
#define USART4_IRQ 52
#define USART5_BASE 0x40005000
#define USART5_GATE RCC_GATE_APB1(20)
#define USART5_IRQ 53
#define USART6_BASE 0x40011400
#define USART6_GATE RCC_GATE_APB2(5)
#define USART6_IRQ 71

#define SPI1_BASE 0x40013000
#define SPI1_GATE RCC_GATE_APB2(12)
#define SPI2_BASE 0x40003800
#define SPI2_GATE RCC_GATE_APB1(14)
#define SPI3_BASE 0x40003c00
#define SPI3_GATE RCC_GATE_APB1(15)
#define SPI4_BASE 0x40013400
#define SPI4_GATE RCC_GATE_APB2(13)
#define SPI5_BASE 0x40015000
#define SPI5_GATE RCC_GATE_APB2(20)
#define SPI6_BASE 0x58001400
#define SPI6_GATE RCC_GATE_APB4(5)

#define I2C1_BASE 0x40005400
#define I2C1_GATE RCC_GATE_APB1(21)
#define I2C2_BASE 0x40005800
#define I2C2_GATE RCC_GATE_APB1(22)
#define I2C3_BASE 0x40005c00
#define I2C3_GATE RCC_GATE_APB1(23)

#define ADC1_BASE 0x40022000
#define ADC1_GATE RCC_GATE_AHB1(5)
#define ADC2_BASE 0x58026000        /* ADC3: second of those in use */
#define ADC2_GATE RCC_GATE_AHB4(24)
#define ADC_COMMON_CCR (*(volatile uint32_t *)0x40022308)
#define ADC2_COMMON_CCR (*(volatile uint32_t *)0x58026308)

#define TIM1_BASE 0x40010000
#define TIM1_GATE RCC_GATE_APB2(0)
#define TIM2_BASE 0x40000000
#define TIM2_GATE RCC_GATE_APB1(0)
#define TIM3_BASE 0x40000400
#define TIM3_GATE RCC_GATE_APB1(1)
#define TIM4_BASE 0x40000800
#define TIM4_GATE RCC_GATE_APB1(2)
#define TIM5_BASE 0x40000c00
#define TIM5_GATE RCC_GATE_APB1(3)
#define TIM12_BASE 0x40001800
#define TIM12_GATE RCC_GATE_APB1(6)
#define TIM13_BASE 0x40001c00
#define TIM13_GATE RCC_GATE_APB1(7)
#define TIM14_BASE 0x40002000
#define TIM14_GATE RCC_GATE_APB1(8)
#define TIM15_BASE 0x40014000
#define TIM15_GATE RCC_GATE_APB2(16)
#define TIM16_BASE 0x40014400
#define TIM16_GATE RCC_GATE_APB2(17)
#define TIM17_BASE 0x40014800
#define TIM17_GATE RCC_GATE_APB2(18)

#define IWDG_BASE 0x58004800

#define OTG_HS_BASE 0x40040000
#define OTG_HS_GATE RCC_GATE_AHB1(25)
#define OTG_HS_IRQ 77
#define OTG_FS_BASE 0x40080000      /* not on the H723 */
#define OTG_FS_GATE RCC_GATE_AHB1(27)
#define OTG_FS_IRQ 101
#define CRS_BASE 0x40008400
#define CRS_GATE RCC_GATE_APB1H(1)
#define FDCAN1_BASE 0x4000a000
#define FDCAN2_BASE 0x4000a400
#define FDCAN_GATE RCC_GATE_APB1H(8)
#define FDCAN1_IRQ 19
#define FDCAN2_IRQ 20
#define FDCAN_RAM 0x4000ac00

#define UID_ADDR 0x1ff1e800

#endif
