/* SPDX-License-Identifier: GPL-3.0-or-later
 * Peripherals of the LPC176x: NXP UM10360 (LPC176x/5x user manual), by chapter.
 */
#ifndef LPC176X_PERIPH_H
#define LPC176X_PERIPH_H

#include <stdint.h>

/* 3 and 4: system control; 5.4: flash accelerator */
struct syscon_regs {
    volatile uint32_t FLASHCFG, reserved0[31];
    volatile uint32_t PLL0CON, PLL0CFG, PLL0STAT, PLL0FEED, reserved1[4];
    volatile uint32_t PLL1CON, PLL1CFG, PLL1STAT, PLL1FEED, reserved2[4];
    volatile uint32_t PCON, PCONP, reserved3[15];
    volatile uint32_t CCLKCFG, USBCLKCFG, CLKSRCSEL, reserved4[28];
    volatile uint32_t RSID, reserved5[7];
    volatile uint32_t SCS, reserved6, PCLKSEL0, PCLKSEL1, reserved7[4];
    volatile uint32_t USBINTST;
};
#define SYSCON_BASE 0x400fc000
#define SYSCON ((struct syscon_regs *)SYSCON_BASE)
#define FLASHCFG_RESERVED 0x03au
#define FLASHCFG_CLOCKS(N) (((N) - 1u) << 12)
#define PLLCON_ENABLE 1u
#define PLLCON_CONNECT 2u
#define PLL0CFG(M, N) (((M) - 1u) | ((N) - 1u) << 16)
#define PLL0STAT_CONNECTED (3u << 24)
#define PLL0STAT_LOCK (1u << 26)
#define PLL1CFG(M, LOG2_P) (((M) - 1u) | (LOG2_P) << 5)
#define PLL1STAT_CONNECTED (3u << 8)
#define PLL1STAT_LOCK (1u << 10)
#define SCS_OSCEN (1u << 5)
#define SCS_OSCSTAT (1u << 6)
#define CLKSRCSEL_IRC 0u
#define CLKSRCSEL_MAIN 1u
/* 4.7.3: every peripheral's clock is the core's; odd fields are reserved */
#define PCLKSEL0_CORE 0x55515155u
#define PCLKSEL1_CORE 0x54555455u
#define USBINTST_ENABLE (1u << 31)

/* 4.8.9: bits of PCONP, and what is on after reset */
#define PCONP_RESET 0x042887deu
#define UART0_POWER 3
#define UART1_POWER 4
#define PWM1_POWER 6
#define I2C0_POWER 7
#define SSP1_POWER 10
#define ADC_POWER 12
#define CAN1_POWER 13
#define CAN2_POWER 14
#define I2C1_POWER 19
#define SSP0_POWER 21
#define UART2_POWER 24
#define UART3_POWER 25
#define I2C2_POWER 26
#define USB_POWER 31

/* 8.5: pins, 16 a register of function or mode */
struct pinconnect_regs {
    volatile uint32_t PINSEL[11], reserved0[5];
    volatile uint32_t PINMODE[10], PINMODE_OD[5], I2CPADCFG;
};
#define PINCONNECT_BASE 0x4002c000
#define PINCONNECT ((struct pinconnect_regs *)PINCONNECT_BASE)
#define PINMODE_UP 0u
#define PINMODE_NONE 2u
#define PINMODE_DOWN 3u

/* 9.5: fast GPIO, a port each 0x20 bytes.  SET reads as the outputs' latch. */
struct gpio_regs {
    volatile uint32_t DIR, reserved0[3], MASK, PIN, SET, CLR;
};
#define GPIO_BASE 0x2009c000

/* 11.10: USB device; endpoints are counted by direction: 2 * number + is_in */
struct usb_regs {
    volatile uint32_t DevIntSt, DevIntEn, DevIntClr, DevIntSet, CmdCode;
    volatile uint32_t CmdData, RxData, TxData, RxPLen, TxPLen, Ctrl;
    volatile uint32_t DevIntPri, EpIntSt, EpIntEn, EpIntClr, EpIntSet;
    volatile uint32_t EpIntPri, ReEp, EpInd, MaxPSize;
};
#define USB_REGS ((struct usb_regs *)0x5000c200)
#define USB_CLK_CTRL (*(volatile uint32_t *)0x5000cff4)
#define USB_CLK_ST (*(volatile uint32_t *)0x5000cff8)
#define USB_IRQ 24
#define USB_CLK_DEVICE 0x12u        /* DEV_CLK_EN, AHB_CLK_EN */
#define USB_INT_EP_SLOW (1u << 2)
#define USB_INT_DEV_STAT (1u << 3)
#define USB_INT_CCEMPTY (1u << 4)
#define USB_INT_CDFULL (1u << 5)
#define USB_INT_EP_RLZED (1u << 8)
#define USB_CTRL_READ(EP) (1u | (EP) << 2)
#define USB_CTRL_WRITE(EP) (2u | (EP) << 2)
#define USB_RXPLEN_LENGTH 0x3ffu
#define USB_RXPLEN_READY (1u << 11)
/* 11.12: commands to the serial interface engine */
#define SIE_COMMAND(CODE) ((CODE) << 16 | 0x0500u)
#define SIE_DATA(VALUE) ((uint32_t)(VALUE) << 16 | 0x0100u)
#define SIE_READ(CODE) ((CODE) << 16 | 0x0200u)
#define SIE_SELECT(ENDPOINT) (ENDPOINT)
#define SIE_ENDPOINT_STATUS(ENDPOINT) (0x40u + (ENDPOINT))
#define SIE_SET_ADDRESS 0xd0u
#define SIE_CONFIGURE 0xd8u
#define SIE_CLEAR_BUFFER 0xf2u
#define SIE_SET_MODE 0xf3u
#define SIE_VALIDATE 0xfau
#define SIE_DEVICE_STATUS 0xfeu
#define SIE_ADDRESS_ENABLE 0x80u
#define SIE_STATUS_CONNECT 0x01u
#define SIE_STATUS_RESET 0x10u
#define SIE_SELECT_FULL 0x01u
#define SIE_SELECT_SETUP 0x04u
#define SIE_BUFFER_OVERWRITTEN 0x01u
#define SIE_ENDPOINT_STALLED 0x01u

/* 14.4, 15.4: UARTs; DLL and DLM are reached while DLAB is set */
struct uart_regs {
    union { volatile uint32_t RBR, THR, DLL; };
    union { volatile uint32_t IER, DLM; };
    union { volatile uint32_t IIR, FCR; };
    volatile uint32_t LCR, MCR, LSR, MSR, SCR, ACR, ICR, FDR, reserved0, TER;
};
#define UART0_BASE 0x4000c000
#define UART0_IRQ 5
#define UART1_BASE 0x40010000
#define UART1_IRQ 6
#define UART2_BASE 0x40098000
#define UART2_IRQ 7
#define UART3_BASE 0x4009c000
#define UART3_IRQ 8
#define UART_IER_RBR 1u
#define UART_IER_THRE 2u
#define UART_FCR_ENABLE 1u
#define UART_FCR_RESET 6u
#define UART_LCR_8_BITS 3u
#define UART_LCR_DLAB 0x80u
#define UART_LSR_RDR 1u
#define UART_LSR_THRE 0x20u
#define UART_FIFO_SIZE 16

/* 16.7: CAN controllers, each with three buffers that send */
struct can_buffer {
    volatile uint32_t TFI, TID, TDA, TDB;
};
struct can_regs {
    volatile uint32_t MOD, CMR, GSR, ICR, IER, BTR, EWL, SR;
    volatile uint32_t RFS, RID, RDA, RDB;
    struct can_buffer TX[3];
};
#define CAN1_BASE 0x40044000
#define CAN2_BASE 0x40048000
#define CAN_IRQ 25
#define CAN_MOD_RESET 1u
#define CAN_MOD_PRIO 8u             /* the buffer with the least PRIO is next */
#define CAN_CMR_SEND(BUFFER) (1u | 0x20u << (BUFFER))
#define CAN_CMR_RELEASE 4u
#define CAN_GSR_RX 1u
#define CAN_GSR_WARNING 0x40u
#define CAN_GSR_OFF 0x80u
#define CAN_GSR_RX_ERRORS(G) ((G) >> 16 & 255u)
#define CAN_GSR_TX_ERRORS(G) ((G) >> 24)
#define CAN_SR_FREE(BUFFER) (4u << 8 * (BUFFER))
#define CAN_SR_ALL_FREE 0x040404u
#define CAN_INT_RX 1u
#define CAN_INT_SENT 0x602u
#define CAN_INT_WARNING 4u
#define CAN_INT_ERROR 0x80u
/* Behind an error of the bus: which way the frame went */
#define CAN_ICR_RECEIVING (1u << 21)
#define CAN_BTR(PRESCALER, SEG1, SEG2) \
    (((PRESCALER) - 1u) | ((SEG1) - 1u) << 16 | ((SEG2) - 1u) << 20)
#define CAN_INFO_LENGTH(I) ((I) >> 16 & 15u)
#define CAN_INFO_REMOTE (1u << 30)
#define CAN_INFO_EXTENDED (1u << 31)

/* 16.14: acceptance filter of both, with tables in a memory of its own */
struct canaf_regs {
    volatile uint32_t AFMR, SFF_SA, SFF_GRP_SA, EFF_SA, EFF_GRP_SA, ENDOFTABLE;
};
#define CANAF ((struct canaf_regs *)CANAF_BASE)
#define CANAF_BASE 0x4003c000
#define CANAF_TABLE ((volatile uint32_t *)0x40038000)
#define CANAF_OFF 1u
#define CANAF_ALL 2u
/* Two ids of controller 0 or 1 in the order of a table; and none */
#define CANAF_IDS(UNIT, A, B) \
    (CANAF_ID(UNIT, A) << 16 | CANAF_ID(UNIT, B))
#define CANAF_ID(UNIT, ID) ((uint32_t)(UNIT) << 13 | (uint32_t)(ID))
#define CANAF_NOBODY 0x17ffu

/* 17.6: SSP, SPI with a fifo of eight */
struct ssp_regs {
    volatile uint32_t CR0, CR1, DR, SR, CPSR, IMSC, RIS, MIS, ICR, DMACR;
};
#define SSP0_BASE 0x40088000
#define SSP1_BASE 0x40030000
#define SSP_CR0_8_BITS 7u
#define SSP_CR0_CPOL (1u << 6)
#define SSP_CR0_CPHA (1u << 7)
#define SSP_CR0_SCR(N) ((N) << 8)
#define SSP_CR1_SSE 2u
#define SSP_SR_TNF 2u
#define SSP_SR_RNE 4u
#define SSP_SR_BSY 0x10u

/* 19.8: I2C */
struct i2c_regs {
    volatile uint32_t CONSET, STAT, DAT, ADR0, SCLH, SCLL, CONCLR;
};
#define I2C0_BASE 0x4001c000
#define I2C1_BASE 0x4005c000
#define I2C2_BASE 0x400a0000
#define I2C_AA 4u
#define I2C_SI 8u
#define I2C_STO 0x10u
#define I2C_STA 0x20u
#define I2C_EN 0x40u
/* 19.10: what has happened */
#define I2C_STAT_START 0x08u
#define I2C_STAT_RESTART 0x10u
#define I2C_STAT_WRITE_ACK 0x18u
#define I2C_STAT_DATA_ACK 0x28u
#define I2C_STAT_READ_ACK 0x40u
#define I2C_STAT_READ_NACK 0x48u
#define I2C_STAT_GOT_ACK 0x50u
#define I2C_STAT_GOT_NACK 0x58u

/* 24.6: PWM1; seven match registers in two rows */
struct pwm_regs {
    volatile uint32_t IR, TCR, TC, PR, PC, MCR, MR0_3[4], CCR, CR[4];
    volatile uint32_t reserved0, MR4_6[3], PCR, LER;
};
#define PWM1_BASE 0x40018000
#define PWM_TCR_ENABLE 1u
#define PWM_TCR_RESET 2u
#define PWM_TCR_PWM 8u
#define PWM_MCR_MR0_RESET 2u
#define PWM_PCR_ENABLE(CHANNEL) (1u << (8 + (CHANNEL)))

/* 28.4: watchdog */
struct wdt_regs {
    volatile uint32_t MOD, TC, FEED, TV, CLKSEL;
};
#define WDT_BASE 0x40000000
#define WDT_MOD_RESET 3u            /* WDEN, WDRESET */
#define WDT_CLKSEL_IRC 0u

/* 29.5: ADC */
struct adc_regs {
    volatile uint32_t CR, GDR, reserved0, INTEN, DR[8], STAT, TRM;
};
#define ADC_BASE 0x40034000
#define ADC_CR_CLKDIV(N) (((N) - 1u) << 8)
#define ADC_CR_PDN (1u << 21)
#define ADC_CR_START (1u << 24)
#define ADC_DR_DONE (1u << 31)

/* 32.7: functions of the boot ROM */
#define IAP_ENTRY 0x1fff1ff1
#define IAP_READ_SERIAL 58u

#endif
