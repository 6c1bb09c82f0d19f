/* SPDX-License-Identifier: GPL-3.0-or-later
 * Registers of the blocks of an RP2040 and RP2350: RP2040 data sheet, chapters
 * 2 and 4; RP2350 data sheet, chapters 5 to 12, where they are the same.
 * Where each block is: chip.h of the port includes rp2040.h or rp2350.h.
 */
#ifndef RP2040_BLOCKS_H
#define RP2040_BLOCKS_H

#include <stdint.h>

/* 2.1.2: the same registers again, where a write changes bits only */
#define RP_XOR(REG) (*(volatile uint32_t *)((uintptr_t)&(REG) + 0x1000))
#define RP_SET(REG) (*(volatile uint32_t *)((uintptr_t)&(REG) + 0x2000))
#define RP_CLR(REG) (*(volatile uint32_t *)((uintptr_t)&(REG) + 0x3000))

/* 2.14.3 resets */
struct resets_regs {
    volatile uint32_t RESET, WDSEL, RESET_DONE;
};

/* 2.13.5 power-on state machine: what a watchdog resets */
struct psm_regs {
    volatile uint32_t FRCE_ON, FRCE_OFF, WDSEL, DONE;
};

/* 2.15.7 clocks: one set of registers a clock */
struct clock_regs {
    volatile uint32_t CTRL, DIV, SELECTED;
};
#define CLK_ENABLE (1u << 11)
#define CLK_REF_SRC_XOSC 2u
#define CLK_SYS_SRC_REF 0u
#define CLK_SYS_SRC_AUX 1u
#define CLK_SYS_AUX_PLL_SYS (0u << 5)
#define CLK_PERI_AUX_SYS (0u << 5)
#define CLK_USB_AUX_PLL_USB (0u << 5)
#define CLK_ADC_AUX_PLL_USB (0u << 5)

/* 2.16.7 crystal oscillator */
struct xosc_regs {
    volatile uint32_t CTRL, STATUS, DORMANT, STARTUP;
};
#define XOSC_CTRL_ENABLE_1_15MHZ (0xfabu << 12 | 0xaa0u)
#define XOSC_STATUS_STABLE (1u << 31)

/* 2.18.4 PLLs */
struct pll_regs {
    volatile uint32_t CS, PWR, FBDIV_INT, PRIM;
};
#define PLL_CS_LOCK (1u << 31)
#define PLL_PWR_PD (1u << 0)
#define PLL_PWR_POSTDIVPD (1u << 3)
#define PLL_PWR_VCOPD (1u << 5)
#define PLL_PRIM(DIV1, DIV2) ((uint32_t)(DIV1) << 16 | (uint32_t)(DIV2) << 12)

/* 2.19.6.1 pins: status and control of each */
struct io_regs {
    struct { volatile uint32_t STATUS, CTRL; } GPIO[48];
};
enum { IO_SPI = 1, IO_UART = 2, IO_I2C = 3, IO_PWM = 4, IO_SIO = 5,
       IO_PIO0 = 6, IO_NONE = 31 };
/* QSPI: the second pin selects the flash chip */
#define IO_QSPI_SELECT 1
#define IO_CTRL_OUTOVER (3u << 8)
#define IO_CTRL_OUTOVER_LOW (2u << 8)

/* 2.19.6.3 pads */
struct pads_regs {
    volatile uint32_t VOLTAGE_SELECT, GPIO[48];
};
#define PAD_SCHMITT (1u << 1)
#define PAD_PULL_DOWN (1u << 2)
#define PAD_PULL_UP (1u << 3)
#define PAD_DRIVE_4MA (1u << 4)
#define PAD_INPUT (1u << 6)
#define PAD_OUTPUT_OFF (1u << 7)

/* 4.2.8 UART (ARM DDI 0183) */
struct uart_regs {
    volatile uint32_t DR, RSR, reserved0[4], FR, reserved1, ILPR, IBRD, FBRD;
    volatile uint32_t LCR_H, CR, IFLS, IMSC, RIS, MIS, ICR;
};
#define UART_FR_RXFE (1u << 4)
#define UART_FR_TXFF (1u << 5)
#define UART_LCR_FIFO (1u << 4)
#define UART_LCR_8_BITS (3u << 5)
#define UART_CR_UARTEN (1u << 0)
#define UART_CR_TXE (1u << 8)
#define UART_CR_RXE (1u << 9)
#define UART_INT_RX (1u << 4)
#define UART_INT_TX (1u << 5)
#define UART_INT_RT (1u << 6)       /* 32 bits' time nothing more came */

/* 4.4.4 SPI (ARM DDI 0194) */
struct spi_regs {
    volatile uint32_t CR0, CR1, DR, SR, CPSR;
};
#define SPI_CR0_8_BITS 7u
#define SPI_CR0_SPO (1u << 6)
#define SPI_CR0_SPH (1u << 7)
#define SPI_CR0_SCR(N) ((N) << 8)
#define SPI_CR1_SSE (1u << 1)
#define SPI_SR_RNE (1u << 2)
#define SPI_SR_BSY (1u << 4)

/* 4.3.17 I2C */
struct i2c_regs {
    volatile uint32_t CON, TAR, SAR, reserved0, DATA_CMD, SS_SCL_HCNT;
    volatile uint32_t SS_SCL_LCNT, FS_SCL_HCNT, FS_SCL_LCNT, reserved1[2];
    volatile uint32_t INTR_STAT, INTR_MASK, RAW_INTR_STAT, RX_TL, TX_TL;
    volatile uint32_t CLR_INTR, CLR_RX_UNDER, CLR_RX_OVER, CLR_TX_OVER;
    volatile uint32_t CLR_RD_REQ, CLR_TX_ABRT, CLR_RX_DONE, CLR_ACTIVITY;
    volatile uint32_t CLR_STOP_DET, CLR_START_DET, CLR_GEN_CALL, ENABLE;
    volatile uint32_t STATUS, TXFLR, RXFLR, SDA_HOLD, TX_ABRT_SOURCE;
    volatile uint32_t reserved2[7], FS_SPKLEN;
};
#define I2C_CON_MASTER (1u << 0)
#define I2C_CON_FAST (2u << 1)
#define I2C_CON_RESTART (1u << 5)
#define I2C_CON_NO_SLAVE (1u << 6)
#define I2C_CMD_READ (1u << 8)
#define I2C_CMD_STOP (1u << 9)
#define I2C_CMD_RESTART (1u << 10)
#define I2C_INT_TX_ABRT (1u << 6)
#define I2C_INT_STOP_DET (1u << 9)
#define I2C_ENABLE_ABORT (1u << 1)
#define I2C_ABRT_7B_NOACK (1u << 0)
#define I2C_ABRT_DATA_NOACK (1u << 3)
#define I2C_STATUS_TFNF (1u << 1)
#define I2C_STATUS_MST_ACTIVITY (1u << 5)

/* 4.9.6 converter */
struct adc_regs {
    volatile uint32_t CS, RESULT, FCS, FIFO, DIV;
};
#define ADC_CS_EN (1u << 0)
#define ADC_CS_TS_EN (1u << 1)
#define ADC_CS_START_ONCE (1u << 2)
#define ADC_CS_READY (1u << 8)
#define ADC_CS_AINSEL(N) ((uint32_t)(N) << 12)

/* 4.5.3 pwm: slices of two channels */
struct pwm_slice {
    volatile uint32_t CSR, DIV, CTR, CC, TOP;
};
#define PWM_CSR_EN 1u

/* 4.6.5 timer of 64 bits */
struct timer_regs {
    volatile uint32_t TIMEHW, TIMELW, TIMEHR, TIMELR, ALARM[4], ARMED;
    volatile uint32_t TIMERAWH, TIMERAWL, DBGPAUSE, PAUSE, INTR, INTE, INTF;
    volatile uint32_t INTS;
};

/* 4.7.6 watchdog; TICK is an RP2040's */
struct watchdog_regs {
    volatile uint32_t CTRL, LOAD, REASON, SCRATCH[8], TICK;
};
#define WATCHDOG_CTRL_ENABLE (1u << 30)
#define WATCHDOG_CTRL_TRIGGER (1u << 31)
#define WATCHDOG_TICK_ENABLE (1u << 9)

/* 3.7 PIO: four state machines, of which each has two queues */
struct pio_regs {
    volatile uint32_t CTRL, FSTAT, FDEBUG, FLEVEL, TXF[4], RXF[4], IRQ;
    volatile uint32_t IRQ_FORCE, INPUT_SYNC_BYPASS, DBG_PADOUT, DBG_PADOE;
    volatile uint32_t DBG_CFGINFO, INSTR_MEM[32];
    struct pio_sm {
        volatile uint32_t CLKDIV, EXECCTRL, SHIFTCTRL, ADDR, INSTR, PINCTRL;
    } SM[4];
    PIO_MORE_REGS
    volatile uint32_t INTR, IRQ0_INTE, IRQ0_INTF, IRQ0_INTS;
};
#define PIO0_BASE 0x50200000
#define PIO_CTRL_ENABLE(SM) (1u << (SM))
#define PIO_CTRL_RESTART(SM) (0x110u << (SM))  /* and its divider */
#define PIO_FSTAT_RXEMPTY(SM) (0x100u << (SM))
#define PIO_EXEC_WRAP(TO, FROM) ((uint32_t)(FROM) << 12 | (uint32_t)(TO) << 7)
#define PIO_EXEC_JMP_PIN(PIN) ((uint32_t)(PIN) << 24)
#define PIO_SHIFT_OUT_RIGHT (1u << 19)
#define PIO_SHIFT_JOIN_RX (1u << 31)
#define PIO_PIN_OUT(PIN, N) ((uint32_t)(N) << 20 | (uint32_t)(PIN))
#define PIO_PIN_SET(PIN, N) ((uint32_t)(N) << 26 | (uint32_t)(PIN) << 5)
#define PIO_PIN_IN(PIN) ((uint32_t)(PIN) << 15)
#define PIO_INT_RX(SM) (1u << (SM))
/* Instructions (3.4) */
#define PIO_JMP(ADDRESS) ((uint32_t)(ADDRESS))
#define PIO_SET_PINS(LEVELS) (0xe000u | (uint32_t)(LEVELS))
#define PIO_SET_DIRECTIONS(OUTPUTS) (0xe080u | (uint32_t)(OUTPUTS))

/* 2.3.1.7 SIO: queues between the cores, at 0x50 of it */
struct fifo_regs {
    volatile uint32_t ST, WR, RD;
};
#define FIFO_ST_VALID (1u << 0)
#define FIFO_ST_READY (1u << 1)
#define FIFO_ST_ERRORS (3u << 2)

/* 4.1.4 USB: memory of the controller, and its registers */
struct usb_memory {
    volatile uint8_t setup[8];
    struct { volatile uint32_t in, out; } control[15];  /* endpoints 1 to 15 */
    struct { volatile uint32_t in, out; } buffer[16];
    volatile uint8_t ep0[128];
    volatile uint8_t data[4096 - 0x180];
};
#define USB_CONTROL_ENABLE (1u << 31)
#define USB_CONTROL_INT (1u << 29)
#define USB_CONTROL_BULK (2u << 26)
#define USB_CONTROL_INTERRUPT (3u << 26)
#define USB_BUFFER_FULL (1u << 15)
#define USB_BUFFER_DATA1 (1u << 13)
#define USB_BUFFER_STALL (1u << 11)
#define USB_BUFFER_AVAILABLE (1u << 10)
#define USB_BUFFER_LENGTH 0x3ffu

struct usb_regs {
    volatile uint32_t ADDR_CTRL, reserved0[15], MAIN_CTRL, SOF_WR, SOF_RD;
    volatile uint32_t SIE_CTRL, SIE_STATUS, INT_EP_CTRL, BUFF_STATUS;
    volatile uint32_t BUFF_CPU_SHOULD_HANDLE, EP_ABORT, EP_ABORT_DONE;
    volatile uint32_t EP_STALL_ARM, NAK_POLL, EP_STATUS_STALL_NAK, USB_MUXING;
    volatile uint32_t USB_PWR, USBPHY_DIRECT, USBPHY_DIRECT_OVERRIDE;
    volatile uint32_t USBPHY_TRIM, reserved1, INTR, INTE, INTF, INTS;
};
#define USB_MAIN_ENABLE (1u << 0)
#define USB_SIE_PULLUP (1u << 16)
#define USB_SIE_EP0_INT (1u << 29)
#define USB_STATUS_SETUP (1u << 17)
#define USB_STATUS_BUS_RESET (1u << 19)
#define USB_MUXING_PHY_SOFTCON (1u << 0 | 1u << 3)
#define USB_PWR_DETECT_OVERRIDE (1u << 2 | 1u << 3)
#define USB_INT_BUFF_STATUS (1u << 4)
#define USB_INT_BUS_RESET (1u << 12)
#define USB_INT_SETUP (1u << 16)

#endif
