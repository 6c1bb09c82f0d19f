/* SPDX-License-Identifier: GPL-3.0-or-later
 * Peripherals of the SAM3X, SAM4S, SAM4E and SAM E70.
 *
 * Data sheets of Atmel and Microchip: 11057 (SAM3X), 11100 (SAM4S), 11157
 * (SAM4E), DS60001527 (SAM E70).  Sections are named by the first of them that
 * has the peripheral.
 */
#ifndef ATSAM_PERIPH_H
#define ATSAM_PERIPH_H

#include <stdint.h>

/* 11057, 28.15: power management controller */
struct pmc_regs {
    volatile uint32_t SCER, SCDR, SCSR, reserved0, PCER0, PCDR0, PCSR0, UCKR;
    volatile uint32_t MOR, MCFR, PLLAR, PLLBR, MCKR, reserved1, USB, reserved2;
    volatile uint32_t PCK[8], IER, IDR, SR, IMR, reserved3[36];
    volatile uint32_t PCER1, PCDR1, PCSR1;
};
#define PMC ((struct pmc_regs *)PMC_BASE)
#define PMC_MOR_MOSCXTEN (1u << 0)
#define PMC_MOR_MOSCRCEN (1u << 3)
#define PMC_MOR_MOSCRCF (7u << 4)
#define PMC_MOR_MOSCXTST(N) ((uint32_t)(N) << 8)
#define PMC_MOR_KEY (0x37u << 16)
#define PMC_MOR_MOSCSEL (1u << 24)
#define PMC_PLLAR_ONE (1u << 29)
#define PMC_PLLAR_MUL(N) (((N) - 1u) << 16)
#define PMC_PLLAR_COUNT(N) ((N) << 8)
#define PMC_PLLAR_DIV1 1u
#define PMC_MCKR_CSS 3u
#define PMC_MCKR_CSS_MAIN 1u
#define PMC_MCKR_CSS_PLLA 2u
#define PMC_MCKR_PRES (7u << 4)
#define PMC_MCKR_PRES_2 (1u << 4)
#define PMC_MCKR_MDIV (3u << 8)      /* SAM E70 */
#define PMC_MCKR_MDIV_2 (1u << 8)
#define PMC_SR_MOSCXTS (1u << 0)
#define PMC_SR_LOCKA (1u << 1)
#define PMC_SR_MCKRDY (1u << 3)
#define PMC_SR_MOSCSELS (1u << 16)

/* Programmable clocks, of a SAM E70 (DS60001527, 31.20) */
#define PMC_SCER_PCK(N) (1u << (8 + (N)))
#define PMC_SR_PCKRDY(N) (1u << (8 + (N)))
#define PMC_PCK_CSS_PLLA 2u
#define PMC_PCK_PRES(N) (((N) - 1u) << 4)

/* 11057, 18.5: flash controller */
struct efc_regs {
    volatile uint32_t FMR, FCR, FSR, FRR;
};
#define EFC_FMR_FWS(N) ((N) << 8)
/* 11057, 18.4.3: commands */
#define EFC_FMR_SCOD (1u << 16)
#define EFC_COMMAND(CODE, ARGUMENT) \
    (0x5a000000u | (ARGUMENT) << 8 | (CODE))
#define EFC_CLEAR_GPNVM 0x0cu
#define EFC_START_ID 0x0eu
#define EFC_STOP_ID 0x0fu
#define EFC_FSR_FRDY 1u
#define GPNVM_BOOT_FLASH 1u


/* 11057, 31.7: pins.  ABCDSR of a SAM3X is one register, ABSR; it has no
 * PPDxx. */
struct pio_regs {
    volatile uint32_t PER, PDR, PSR, reserved0, OER, ODR, OSR, reserved1;
    volatile uint32_t IFER, IFDR, IFSR, reserved2, SODR, CODR, ODSR, PDSR;
    volatile uint32_t IER, IDR, IMR, ISR, MDER, MDDR, MDSR, reserved3;
    volatile uint32_t PUDR, PUER, PUSR, reserved4, ABCDSR[2], reserved5[6];
    volatile uint32_t PPDDR, PPDER, PPDSR, reserved6, OWER, OWDR, OWSR;
};
#define PIO_BASE(PORT) (PIOA_BASE + 0x200 * (PORT))

/* 11057, 34.6: UART */
struct uart_regs {
    volatile uint32_t CR, MR, IER, IDR, IMR, SR, RHR, THR, BRGR;
};
#define UART_CR_RESET 0x10cu         /* RSTRX, RSTTX, RSTSTA */
#define UART_CR_ENABLE 0x50u         /* RXEN, TXEN */
#define UART_MR_NO_PARITY (4u << 9)
#define UART_SR_RXRDY 1u
#define UART_SR_TXRDY 2u

/* 11057, 43.7: ADC (SAM3X, SAM4S) */
struct adc_regs {
    volatile uint32_t CR, MR, SEQR[2], CHER, CHDR, CHSR, reserved0, LCDR;
    volatile uint32_t IER, IDR, IMR, ISR, reserved1[2], OVER, EMR, CWR, CGR;
    volatile uint32_t COR, CDR[16], reserved2, ACR;
};
#define ADC_ACR_TSON (1u << 4)

/* 11157, 43.7: AFEC (SAM4E, SAM E70) */
struct afec_regs {
    volatile uint32_t CR, MR, EMR, SEQR[2], CHER, CHDR, CHSR, LCDR;
    volatile uint32_t IER, IDR, IMR, ISR, reserved0[6], OVER, CWR, CGR;
    volatile uint32_t reserved1, CDOR, DIFFR, CSELR, CDR, COCR, TEMPMR;
    volatile uint32_t TEMPCWR, reserved2[7], ACR;
};
#define AFEC_ACR_PGA (3u << 2)       /* SAM E70: both amplifiers on */
/* Of both */
#define ADC_CR_SWRST 1u
#define ADC_CR_START 2u
#define ADC_MR_PRESCAL(N) ((N) << 8)
#define ADC_MR_STARTUP_512 (8u << 16)
#define ADC_MR_SETTLING_17 (3u << 20)
#define AFEC_MR_ONE (1u << 23)
#define ADC_MR_TRACKTIM_16 (15u << 24)
#define ADC_MR_TRANSFER(N) ((N) << 28)
#define ADC_ISR_DRDY (1u << 24)

/* 11057, 38.7: PWM; the channels' registers begin at 0x200 */
struct pwm_channel {
    volatile uint32_t CMR, CDTY, CDTYUPD, CPRD, CPRDUPD, CCNT, DT, DTUPD;
};
struct pwm_regs {
    volatile uint32_t CLK, ENA, DIS, SR, reserved0[124];
    struct pwm_channel channels[8];
};
#define PWM_CMR_CPOL (1u << 9)

/* 11057, 32.8: SPI */
struct spi_regs {
    volatile uint32_t CR, MR, RDR, TDR, SR, IER, IDR, IMR, reserved0[4];
    volatile uint32_t CSR[4];
};
#define SPI_CR_SPIEN 1u
#define SPI_CR_SWRST 0x80u
#define SPI_MR_MASTER 0x000e0011u    /* MSTR, MODFDIS, settings of CSR[0] */
#define SPI_SR_RDRF 1u
#define SPI_SR_TXEMPTY (1u << 9)
#define SPI_CSR_CPOL 1u
#define SPI_CSR_NCPHA 2u
#define SPI_CSR_SCBR(N) ((N) << 8)

/* 11057, 35.8: USART, here as SPI master */
struct usart_regs {
    volatile uint32_t CR, MR, IER, IDR, IMR, CSR, RHR, THR, BRGR;
};
#define USART_CR_RESET 0x10cu
#define USART_CR_ENABLE 0x50u
#define USART_MR_SPI_MASTER 0x000400ceu /* USART_MODE, 8 bits, CLKO */
#define USART_MR_NCPHA (1u << 8)
#define USART_MR_CPOL (1u << 16)
#define USART_CSR_RXRDY 1u
#define USART_CSR_TXEMPTY (1u << 9)

/* 11057, 33.11: two-wire interface */
struct twi_regs {
    volatile uint32_t CR, MMR, SMR, IADR, CWGR, reserved0[3], SR, IER, IDR;
    volatile uint32_t IMR, RHR, THR;
};
#define TWI_CR_START 1u
#define TWI_CR_STOP 2u
#define TWI_CR_MSEN 4u
#define TWI_CR_SVDIS 0x20u
#define TWI_CR_QUICK 0x40u
#define TWI_CR_SWRST 0x80u
#define TWI_MMR_IADRSZ(N) ((uint32_t)(N) << 8)
#define TWI_MMR_MREAD (1u << 12)
#define TWI_MMR_DADR(N) ((uint32_t)(N) << 16)
#define TWI_CWGR(LOW, HIGH, LOG2) ((LOW) | (HIGH) << 8 | (LOG2) << 16)
#define TWI_SR_TXCOMP 1u
#define TWI_SR_RXRDY 2u
#define TWI_SR_TXRDY 4u
#define TWI_SR_OVRE 0x40u
#define TWI_SR_NACK 0x100u

/* 11057, 15.5: watchdog, of the slow clock by 128; MR is written once */
struct wdt_regs {
    volatile uint32_t CR, MR, SR;
};
#define WDT_CR_RESTART 0xa5000001u
#define WDT_MR_WDV(N) (N)
#define WDT_MR_WDRSTEN (1u << 13)
#define WDT_MR_WDDIS (1u << 15)
#define WDT_MR_WDD_ANY (0xfffu << 16) /* it may be restarted at any time */

/* Pins that serve the system after reset: 11100, 27.8 (bus matrix) */
#define CCFG_SYSIO (*(volatile uint32_t *)(MATRIX_BASE + 0x114))
/* DS60001527, 19.4.7 and 19.4.8: the upper half of each of the two is that of
 * the addresses which MCAN0 and MCAN1 use */
#define CCFG_CAN0 (*(volatile uint32_t *)(MATRIX_BASE + 0x110))

#endif
