/* SPDX-License-Identifier: GPL-3.0-or-later
 * Registers of blocks that all SAM C and D chips have, by the data sheets of
 * SAM D21 (DS40001882), C21 (DS60001479) and D5x/E5x (DS60001507): chapters
 * PORT, SERCOM, USB, TCC, and the serial number.  Where the blocks are: d21.h,
 * c21.h, d51.h.
 */
#ifndef ATSAMD_BLOCKS_H
#define ATSAMD_BLOCKS_H

#include <stdint.h>

#define SAMD_REG8(ADDR) (*(volatile uint8_t *)(ADDR))
#define SAMD_REG16(ADDR) (*(volatile uint16_t *)(ADDR))
#define SAMD_REG32(ADDR) (*(volatile uint32_t *)(ADDR))

/* A clock that feeds a peripheral's bus interface: register's offset, bit */
#define SAMD_GATE(OFFSET, BIT) ((OFFSET) << 5 | (BIT))

/* PORT: a group of 32 pins */
struct port_regs {
    volatile uint32_t DIR, DIRCLR, DIRSET, DIRTGL, OUT, OUTCLR, OUTSET, OUTTGL;
    volatile uint32_t IN, CTRL, WRCONFIG, EVCTRL;
    volatile uint8_t PMUX[16], PINCFG[32], reserved[32];
};
#define PORT_PINCFG_PMUXEN (1u << 0)
#define PORT_PINCFG_INEN (1u << 1)
#define PORT_PINCFG_PULLEN (1u << 2)

/* SERCOM: usart, SPI and I2C masters */
struct sercom_regs {
    volatile uint32_t CTRLA, CTRLB, CTRLC;
    union { volatile uint32_t BAUD; volatile uint16_t BAUD16;
            volatile uint8_t BAUD8; };
    volatile uint8_t reserved0[4], INTENCLR, reserved1, INTENSET, reserved2;
    volatile uint8_t INTFLAG, reserved3;
    volatile uint16_t STATUS;
    volatile uint32_t SYNCBUSY, reserved4, ADDR;
    union { volatile uint8_t DATA8; volatile uint16_t DATA16; };
};
#define SERCOM_CTRLA_SWRST (1u << 0)
#define SERCOM_CTRLA_ENABLE (1u << 1)
#define SERCOM_CTRLA_MODE(N) ((uint32_t)(N) << 2)
enum { SERCOM_MODE_USART = 1, SERCOM_MODE_SPI = 3, SERCOM_MODE_I2C = 5 };
#define SERCOM_CTRLA_TXPO(N) ((uint32_t)(N) << 16)   /* DOPO of SPI */
#define SERCOM_CTRLA_RXPO(N) ((uint32_t)(N) << 20)   /* DIPO of SPI */
#define SERCOM_CTRLA_DORD (1u << 30)
#define SERCOM_CTRLA_CPHA (1u << 28)
#define SERCOM_CTRLA_CPOL (1u << 29)
#define SERCOM_CTRLA_SDAHOLD_450NS (2u << 20)
#define SERCOM_CTRLA_INACTOUT_205US (3u << 28)
#define SERCOM_CTRLB_TXEN (1u << 16)
#define SERCOM_CTRLB_RXEN (1u << 17)
#define SERCOM_CTRLB_CMD(N) ((uint32_t)(N) << 16)
enum { SERCOM_CMD_READ = 2, SERCOM_CMD_STOP = 3 };
#define SERCOM_CTRLB_NACK (1u << 18)
#define SERCOM_INT_DRE (1u << 0)    /* MB of I2C */
#define SERCOM_INT_TXC (1u << 1)    /* SB of I2C */
#define SERCOM_INT_RXC (1u << 2)
#define SERCOM_INT_MB (1u << 0)
#define SERCOM_INT_SB (1u << 1)
#define SERCOM_INT_ERROR (1u << 7)
#define SERCOM_STATUS_BUFOVF (1u << 2)
#define SERCOM_STATUS_BUSERR (1u << 0)
#define SERCOM_STATUS_ARBLOST (1u << 1)
#define SERCOM_STATUS_RXNACK (1u << 2)
#define SERCOM_STATUS_IDLE (1u << 4)

/* TCC: timer for pulse widths; CCB[] is what CC[] becomes at the next cycle */
struct tcc_regs {
    volatile uint32_t CTRLA;
    volatile uint8_t CTRLBCLR, CTRLBSET, reserved0[2];
    volatile uint32_t SYNCBUSY, reserved1[9], STATUS, COUNT, PATT, WAVE, PER;
    volatile uint32_t CC[4], reserved2[6], PERB, CCB[4];
};
#define TCC_CTRLA_ENABLE (1u << 1)
#define TCC_CTRLA_PRESCALER(N) ((uint32_t)(N) << 8)
#define TCC_WAVE_NPWM 2u

/* USB device: registers, and what it reads in memory */
struct usb_endpoint_regs {
    volatile uint8_t EPCFG, reserved0[3], STATUSCLR, STATUSSET, STATUS;
    volatile uint8_t INTFLAG, INTENCLR, INTENSET, reserved1[22];
};
struct usb_regs {
    volatile uint8_t CTRLA, reserved0, SYNCBUSY, QOSCTRL;
    volatile uint32_t reserved1;
    volatile uint16_t CTRLB;
    volatile uint8_t DADD, reserved2, STATUS, FSMSTATUS, reserved3[2];
    volatile uint16_t FNUM, reserved4, INTENCLR, reserved5, INTENSET, reserved6;
    volatile uint16_t INTFLAG, reserved7, EPINTSMRY, reserved8;
    volatile uint32_t DESCADD;
    volatile uint16_t PADCAL;
    volatile uint8_t reserved9[0x100 - 0x2a];
    struct usb_endpoint_regs EP[8];
};
#define USB_CTRLA_SWRST (1u << 0)
#define USB_CTRLA_ENABLE (1u << 1)
#define USB_CTRLB_DETACH (1u << 0)
#define USB_DADD_ADDEN (1u << 7)
#define USB_INT_EORST (1u << 3)
/* EPCFG: type of the OUT or setup bank, and of the IN bank */
#define USB_EPCFG(OUT, IN) ((OUT) | (IN) << 4)
enum { USB_TYPE_CONTROL = 1, USB_TYPE_BULK = 3, USB_TYPE_INTERRUPT = 4 };
#define USB_EP_DTGLOUT (1u << 0)
#define USB_EP_DTGLIN (1u << 1)
#define USB_EP_STALLRQ0 (1u << 4)
#define USB_EP_STALLRQ1 (1u << 5)
#define USB_EP_BK0RDY (1u << 6)
#define USB_EP_BK1RDY (1u << 7)
#define USB_EPINT_TRCPT0 (1u << 0)
#define USB_EPINT_TRCPT1 (1u << 1)
#define USB_EPINT_RXSTP (1u << 4)

/* Two banks an endpoint: OUT, IN */
struct usb_bank {
    volatile uint32_t ADDR, PCKSIZE;
    volatile uint16_t EXTREG;
    volatile uint8_t STATUS_BK, reserved[5];
};
#define USB_PCKSIZE_COUNT 0x3fffu
#define USB_PCKSIZE_SIZE(BYTES) \
    ((BYTES) == 64 ? 3u << 28 : (BYTES) == 16 ? 1u << 28 : 0u)

#endif
