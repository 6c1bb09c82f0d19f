/* SPDX-License-Identifier: GPL-3.0-or-later
 * STM32F2, F4 and F7: RM0090, 2.3 (addresses), 3.9 (flash access), 5.4 (PWR),
 * 7.3 (RCC), 12.2 (interrupts); RM0410, 4.4 and 5.3 for what the F7 does
 * differently.
 */
#ifndef STM32_F2F4F7_H
#define STM32_F2F4F7_H

#include "stm32/periph.h"

struct rcc_regs {
    volatile uint32_t CR, PLLCFGR, CFGR, CIR, AHB1RSTR, AHB2RSTR, AHB3RSTR;
    volatile uint32_t reserved0, APB1RSTR, APB2RSTR, reserved1[2];
    volatile uint32_t AHB1ENR, AHB2ENR, AHB3ENR, reserved2, APB1ENR, APB2ENR;
};
#define RCC_BASE 0x40023800
#define RCC_CR_HSION (1u << 0)
#define RCC_CR_HSIRDY (1u << 1)
#define RCC_CR_HSEON (1u << 16)
#define RCC_CR_HSERDY (1u << 17)
#define RCC_CR_PLLON (1u << 24)
#define RCC_CR_PLLRDY (1u << 25)
#define RCC_PLLCFGR_M(M) (M)
#define RCC_PLLCFGR_N(N) ((N) << 6)
#define RCC_PLLCFGR_P(P) (((P) / 2u - 1u) << 16)
#define RCC_PLLCFGR_SRC_HSE (1u << 22)
#define RCC_PLLCFGR_Q(Q) ((Q) << 24)
#define RCC_PLLCFGR_R(R) ((R) << 28)  /* F446, F76x */
#define RCC_CFGR_SW_PLL 2u
#define RCC_CFGR_SWS (3u << 2)
#define RCC_CFGR_SWS_PLL (2u << 2)
#define RCC_CFGR_PPRE1_2 (4u << 10)
#define RCC_CFGR_PPRE1_4 (5u << 10)
#define RCC_CFGR_PPRE2_2 (4u << 13)
#define RCC_CR_PLLSAION (1u << 28)      /* F446, F76x */
#define RCC_CR_PLLSAIRDY (1u << 29)
#define RCC_PLLSAICFGR (*(volatile uint32_t *)(RCC_BASE + 0x88))
#define RCC_PLLSAICFGR_M(M) (M)         /* F446 */
#define RCC_PLLSAICFGR_N(N) ((N) << 6)
#define RCC_PLLSAICFGR_P(P) (((P) / 2u - 1u) << 16)
#define RCC_DCKCFGR2 (*(volatile uint32_t *)(RCC_BASE + 0x94))
#define RCC_DCKCFGR2_CK48_SAI (1u << 27)
#define RCC_GATE_AHB2(BIT) STM32_GATE(0x34, BIT)
#define RCC_GATE_AHB1(BIT) STM32_GATE(0x30, BIT)
#define RCC_GATE_APB1(BIT) STM32_GATE(0x40, BIT)
#define RCC_GATE_APB2(BIT) STM32_GATE(0x44, BIT)

struct pwr_regs {
    volatile uint32_t CR, CSR;
};
#define PWR ((struct pwr_regs *)0x40007000)
#define PWR_GATE RCC_GATE_APB1(28)
#define PWR_CR_VOS_MASK (3u << 14)
#define PWR_CR_VOS_F40X (1u << 14)  /* scale 1 where there are two */
#define PWR_CR_VOS_SCALE1 (3u << 14)
#define PWR_CR_VOS_SCALE2 (2u << 14)
#define PWR_CR_ODEN (1u << 16)
#define PWR_CR_ODSWEN (1u << 17)
#define PWR_CSR_ODRDY (1u << 16)
#define PWR_CSR_ODSWRDY (1u << 17)

#define FLASH_ACR (*(volatile uint32_t *)0x40023c00)
#define FLASH_ACR_PRFTEN (1u << 8)
#define FLASH_ACR_ICEN (1u << 9)    /* F7: ARTEN */
#define FLASH_ACR_DCEN (1u << 10)   /* not on F7 */

#define GPIO_BASE 0x40020000
#define GPIO_GATE(PORT) RCC_GATE_AHB1(PORT)

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
#define SDIO_BASE 0x40012c00
#define SDIO_GATE RCC_GATE_APB2(11)
#define SPI4_GATE RCC_GATE_APB2(13)
#define SPI5_BASE 0x40015000
#define SPI5_GATE RCC_GATE_APB2(20)
#define SPI6_BASE 0x40015400
#define SPI6_GATE RCC_GATE_APB2(21)

#define I2C1_BASE 0x40005400
#define I2C1_GATE RCC_GATE_APB1(21)
#define I2C2_BASE 0x40005800
#define I2C2_GATE RCC_GATE_APB1(22)
#define I2C3_BASE 0x40005c00
#define I2C3_GATE RCC_GATE_APB1(23)

#define ADC1_BASE 0x40012000
#define ADC1_GATE RCC_GATE_APB2(8)
#define ADC3_BASE 0x40012200
#define ADC3_GATE RCC_GATE_APB2(10)
#define ADC_COMMON_CCR (*(volatile uint32_t *)0x40012304)
#define ADC_CCR_ADCPRE_4 (1u << 16)
#define ADC_CCR_ADCPRE_6 (2u << 16)
#define ADC_CCR_TSVREFE (1u << 23)

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
#define TIM8_BASE 0x40010400
#define TIM8_GATE RCC_GATE_APB2(1)
#define TIM9_BASE 0x40014000
#define TIM9_GATE RCC_GATE_APB2(16)
#define TIM10_BASE 0x40014400
#define TIM10_GATE RCC_GATE_APB2(17)
#define TIM11_BASE 0x40014800
#define TIM11_GATE RCC_GATE_APB2(18)
#define TIM12_BASE 0x40001800
#define TIM12_GATE RCC_GATE_APB1(6)
#define TIM13_BASE 0x40001c00
#define TIM13_GATE RCC_GATE_APB1(7)
#define TIM14_BASE 0x40002000
#define TIM14_GATE RCC_GATE_APB1(8)

#define IWDG_BASE 0x40003000

#define OTG_FS_BASE 0x50000000
#define OTG_FS_GATE RCC_GATE_AHB2(7)
#define OTG_FS_IRQ 67
#define CAN1_BASE 0x40006400
#define CAN1_GATE RCC_GATE_APB1(25)
#define CAN1_TX_IRQ 19
#define CAN1_RX0_IRQ 20
#define CAN1_SCE_IRQ 22
#define CAN2_BASE 0x40006800
#define CAN2_GATE RCC_GATE_APB1(26)
#define CAN2_TX_IRQ 63
#define CAN2_RX0_IRQ 64
#define CAN2_SCE_IRQ 66

#define PWR_CR_DBP (1u << 8)
/* Backup register N, from 0: RM0090, 26.6 */
#define RTC_BKP(N) (*(volatile uint32_t *)(0x40002850 + 4 * (N)))

#if CONFIG_MACH_STM32F7
#define UID_ADDR 0x1ff0f420
#else
#define UID_ADDR 0x1fff7a10
#endif

#endif
