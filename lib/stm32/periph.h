/* SPDX-License-Identifier: GPL-3.0-or-later
 * Peripherals that several lines of STM32 share.
 *
 * Reference manuals of ST: RM0008 (F103), RM0033 (F207), RM0090 (F40x, F42x),
 * RM0368 (F401), RM0390 (F446), RM0410 (F76x), RM0091 (F0), RM0360 (F0x0),
 * RM0444 (G0x1), RM0440 (G4), RM0351 (L4), RM0433 (H743), RM0468 (H723).
 * Sections are named below by one of them.
 */
#ifndef STM32_PERIPH_H
#define STM32_PERIPH_H

#include <stdint.h>

/* Where a peripheral's clock is enabled: a register of RCC and a bit. */
#define STM32_GATE(OFFSET, BIT) ((OFFSET) << 5 | (BIT))

/* GPIO with two nibble registers: RM0008, 9.2 */
struct gpio_v1_regs {
    volatile uint32_t CRL, CRH, IDR, ODR, BSRR, BRR, LCKR;
};

/* GPIO with mode, type, speed and pull: RM0090, 8.4 */
struct gpio_v2_regs {
    volatile uint32_t MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, LCKR;
    volatile uint32_t AFR[2];
};

/* USART with one data register: RM0008, 27.6; RM0090, 30.6 */
struct usart_v1_regs {
    volatile uint32_t SR, DR, BRR, CR1, CR2, CR3, GTPR;
};

/* USART with two: RM0091, 27.8; RM0440, 37.8 */
struct usart_v2_regs {
    volatile uint32_t CR1, CR2, CR3, BRR, GTPR, RTOR, RQR, ISR, ICR, RDR, TDR;
};
/* Status of both */
#define USART_ORE (1u << 3)
#define USART_RXNE (1u << 5)
#define USART_TXE (1u << 7)
#define USART_CR1_RE (1u << 2)
#define USART_CR1_TE (1u << 3)
#define USART_CR1_RXNEIE (1u << 5)
#define USART_CR1_TXEIE (1u << 7)
#define USART_V1_CR1_UE (1u << 13)
#define USART_V2_CR1_UE (1u << 0)

/* ADC with a sequence of up to 16: RM0008, 11.12; RM0090, 13.13 */
struct adc_v1_regs {
    volatile uint32_t SR, CR1, CR2, SMPR[2], JOFR[4], HTR, LTR, SQR[3], JSQR;
    volatile uint32_t JDR[4], DR;
};
#define ADC_V1_SR_EOC (1u << 1)
#define ADC_V1_CR2_ADON (1u << 0)
#define ADC_F1_CR2_CAL (1u << 2)
#define ADC_F1_CR2_EXTSEL_SW (7u << 17)
#define ADC_F1_CR2_EXTTRIG (1u << 20)
#define ADC_F1_CR2_SWSTART (1u << 22)
#define ADC_F1_CR2_TSVREFE (1u << 23)
#define ADC_F4_CR2_SWSTART (1u << 30)

/* ADC that converts a set of channels: RM0091, 13.12; RM0444, 15.12 */
struct adc_v2_regs {
    volatile uint32_t ISR, IER, CR, CFGR1, CFGR2, SMPR, reserved0[2];
    volatile uint32_t TR, reserved1, CHSELR, reserved2[5], DR;
};

/* ADC with calibration and a sequence: RM0440, 21.7; RM0433, 25.6 */
struct adc_v3_regs {
    volatile uint32_t ISR, IER, CR, CFGR, CFGR2, SMPR[2], PCSEL;
    volatile uint32_t reserved0[4], SQR[4], DR;
};
/* Of both */
#define ADC_ISR_ADRDY (1u << 0)
#define ADC_ISR_EOC (1u << 2)
#define ADC_ISR_CCRDY (1u << 13)    /* G0 */
#define ADC_CR_ADEN (1u << 0)
#define ADC_CR_ADDIS (1u << 1)
#define ADC_CR_ADSTART (1u << 2)
#define ADC_CR_ADSTP (1u << 4)
#define ADC_CR_ADVREGEN (1u << 28)
#define ADC_CR_DEEPPWD (1u << 29)
#define ADC_CR_ADCAL (1u << 31)
#define ADC_V2_CFGR2_PCLK4 (2u << 30)
#define ADC_CCR_TSEN (1u << 23)
#define ADC_CFGR_JQDIS (1u << 31)

/* Timers: RM0008, 14.4 and 15.4.  CCMR1 and 2 hold two channels each. */
struct tim_regs {
    volatile uint32_t CR1, CR2, SMCR, DIER, SR, EGR, CCMR[2], CCER, CNT, PSC;
    volatile uint32_t ARR, RCR, CCR[4], BDTR;
};
#define TIM_CR1_CEN (1u << 0)
#define TIM_CR1_ARPE (1u << 7)
#define TIM_SR_UIF (1u << 0)
#define TIM_SR_CC1IF (1u << 1)
#define TIM_DIER_UIE (1u << 0)
#define TIM_DIER_CC1IE (1u << 1)
#define TIM_EGR_UG (1u << 0)
#define TIM_BDTR_MOE (1u << 15)
#define TIM_CCMR_PWM1_PRELOAD 0x68u /* OCxM = 6, OCxPE */

/* SPI of all but the H7: RM0008, 25.5; RM0091, 28.9.  DR is accessed as bytes
 * where it has a fifo. */
struct spi_v1_regs {
    volatile uint32_t CR1, CR2, SR, DR;
};
#define SPI_CR1_MSTR (1u << 2)
#define SPI_CR1_BR(N) ((N) << 3)
#if CONFIG_MACH_STM32H7
#define SPI_CR1_SPE (1u << 0)
#define SPI_CR1_CSTART (1u << 9)
#define SPI_CR1_SSI (1u << 12)
#else
#define SPI_CR1_SPE (1u << 6)
#define SPI_CR1_SSI (1u << 8)
#endif
#define SPI_CR1_SSM (1u << 9)
#define SPI_SR_RXNE (1u << 0)
#define SPI_SR_BSY (1u << 7)
#define SPI_CR2_8_BITS (7u << 8)
#define SPI_CR2_FRXTH (1u << 12)

/* SPI of the H7: RM0433, 50.11 */
struct spi_v2_regs {
    volatile uint32_t CR1, CR2, CFG1, CFG2, IER, SR, IFCR, reserved0, TXDR;
    volatile uint32_t reserved1[3], RXDR;
};
#define SPI_CFG1_8_BITS 7u
#define SPI_CFG1_MBR(N) ((N) << 28)
#define SPI_CFG2_MASTER (1u << 22)
#define SPI_CFG2_CPHA (1u << 24)
#define SPI_CFG2_CPOL (1u << 25)
#define SPI_CFG2_SSM (1u << 26)
#define SPI_CFG2_AFCNTR (1u << 31)
#define SPI_SR_RXP (1u << 0)
#define SPI_SR_TXP (1u << 1)
#define SPI_SR_EOT (1u << 3)
#define SPI_IFCR_EOT (1u << 3)
#define SPI_IFCR_TXTF (1u << 4)

/* I2C of F1, F2 and F4: RM0008, 26.6 */
struct i2c_v1_regs {
    volatile uint32_t CR1, CR2, OAR1, OAR2, DR, SR1, SR2, CCR, TRISE;
};
#define I2C_V1_CR1_PE (1u << 0)
#define I2C_V1_CR1_START (1u << 8)
#define I2C_V1_CR1_STOP (1u << 9)
#define I2C_V1_CR1_ACK (1u << 10)
#define I2C_V1_CR1_POS (1u << 11)
#define I2C_V1_CR1_SWRST (1u << 15)
#define I2C_V1_CCR_MAX 0xfffu
#define I2C_V1_CCR_FAST (1u << 15)
#define I2C_V1_SR1_SB (1u << 0)
#define I2C_V1_SR1_ADDR (1u << 1)
#define I2C_V1_SR1_BTF (1u << 2)
#define I2C_V1_SR1_RXNE (1u << 6)
#define I2C_V1_SR1_AF (1u << 10)

/* I2C of the others: RM0091, 26.7 */
struct i2c_v2_regs {
    volatile uint32_t CR1, CR2, OAR1, OAR2, TIMINGR, TIMEOUTR, ISR, ICR, PECR;
    volatile uint32_t RXDR, TXDR;
};
#define I2C_V2_CR1_PE (1u << 0)
#define I2C_CR2_ADDRESS(N) ((uint32_t)(N) << 1)
#define I2C_CR2_READ (1u << 10)
#define I2C_CR2_START (1u << 13)
#define I2C_CR2_COUNT(N) ((uint32_t)(N) << 16)
#define I2C_CR2_AUTOEND (1u << 25)
#define I2C_ISR_TXE (1u << 0)
#define I2C_ISR_TXIS (1u << 1)
#define I2C_ISR_RXNE (1u << 2)
#define I2C_ISR_NACKF (1u << 4)
#define I2C_ISR_STOPF (1u << 5)
#define I2C_ISR_TC (1u << 6)
#define I2C_TIMINGR(PRESCALER, SETUP, HOLD, LOW, HIGH) \
    (((PRESCALER) - 1u) << 28 | ((SETUP) - 1u) << 20 | (HOLD) << 16 \
     | ((HIGH) - 1u) << 8 | ((LOW) - 1u))

/* Independent watchdog: RM0008, 19.4.  WINR is not on all. */
struct iwdg_regs {
    volatile uint32_t KR, PR, RLR, SR, WINR;
};
#define IWDG_KEY_UNLOCK 0x5555u
#define IWDG_KEY_RELOAD 0xaaaau
#define IWDG_KEY_START 0xccccu

#endif
