/* SPDX-License-Identifier: GPL-3.0-or-later
 * STM32F103: RM0008, 3.3 (addresses), 7.3 (RCC), 9.4 (AFIO), 10.1.2
 * (interrupts); PM0075, 3.1 (flash access).
 */
#ifndef STM32_F1_H
#define STM32_F1_H

#include "stm32/periph.h"

struct rcc_regs {
    volatile uint32_t CR, CFGR, CIR, APB2RSTR, APB1RSTR, AHBENR, APB2ENR;
    volatile uint32_t APB1ENR, BDCR, CSR;
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
#define RCC_CFGR_PPRE1_2 (4u << 8)
#define RCC_CFGR_ADCPRE_6 (2u << 14)
#define RCC_CFGR_PLLSRC_HSE (1u << 16)
#define RCC_CFGR_PLLXTPRE (1u << 17)
#define RCC_CFGR_PLLMUL(N) (((N) - 2u) << 18)
#define RCC_GATE_APB2(BIT) STM32_GATE(0x18, BIT)
#define RCC_GATE_APB1(BIT) STM32_GATE(0x1c, BIT)

#define FLASH_ACR (*(volatile uint32_t *)0x40022000)
#define FLASH_ACR_PRFTBE (1u << 4)

#define AFIO_MAPR (*(volatile uint32_t *)0x40010004)
#define AFIO_GATE RCC_GATE_APB2(0)
#define AFIO_MAPR_SWJ_NO_JTAG (2u << 24)
#define AFIO_MAPR_SWJ_OFF (4u << 24)
#define AFIO_MAPR_SWJ (7u << 24)

#define GPIO_BASE 0x40010800
#define GPIO_GATE(PORT) RCC_GATE_APB2(2 + (PORT))

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

#define ADC1_BASE 0x40012400
#define ADC1_GATE RCC_GATE_APB2(9)

#define TIM1_BASE 0x40012c00
#define TIM1_GATE RCC_GATE_APB2(11)
#define TIM2_BASE 0x40000000
#define TIM2_GATE RCC_GATE_APB1(0)
#define TIM3_BASE 0x40000400
#define TIM3_GATE RCC_GATE_APB1(1)
#define TIM4_BASE 0x40000800
#define TIM4_GATE RCC_GATE_APB1(2)

#define IWDG_BASE 0x40003000

#define USB_BASE 0x40005c00
#define USB_GATE RCC_GATE_APB1(23)
#define USB_IRQ 20                  /* of low priority */
#define USB_PMA 0x40006000
#define CAN1_BASE 0x40006400
#define CAN1_GATE RCC_GATE_APB1(25)
#define CAN1_TX_IRQ 19
#define CAN1_RX0_IRQ 20
#define CAN1_SCE_IRQ 22
#define AFIO_MAPR_CAN_PB8 (2u << 13)
#define AFIO_MAPR_CAN_PD0 (3u << 13)
#define AFIO_MAPR_CAN (3u << 13)

#define PWR_CR (*(volatile uint32_t *)0x40007000)
#define PWR_CR_DBP (1u << 8)
#define PWR_GATE RCC_GATE_APB1(28)
#define BKP_GATE RCC_GATE_APB1(27)
/* Backup register N, of 1 to 10: RM0008, 6.4 */
#define BKP_DR(N) (*(volatile uint32_t *)(0x40006c00 + 4 * (N)))

#define UID_ADDR 0x1ffff7e8

#endif
