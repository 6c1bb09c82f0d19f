/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * An emulated RP2040: what its blocks know of each other.
 */
#ifndef UNICORN_RP2040_H
#define UNICORN_RP2040_H

#include "unicorn_chip.h"

enum { RP_PINS = 48, RP_FIFO = 32 };
/* Blocks of the peripheral bus, 16 KiB each */
enum rp_block {
    RP_SYSINFO, RP_SYSCFG, RP_CLOCKS, RP_RESETS, RP_PSM, RP_IO_BANK0,
    RP_IO_QSPI, RP_PADS_BANK0, RP_PADS_QSPI, RP_XOSC, RP_PLL_SYS, RP_PLL_USB,
    RP_BUSCTRL, RP_UART0, RP_UART1, RP_SPI0, RP_SPI1, RP_I2C0, RP_I2C1, RP_ADC,
    RP_PWM, RP_TIMER, RP_WATCHDOG, RP_RTC, RP_ROSC, RP_VREG, RP_TICKS, RP_OTP,
    RP_N_BLOCKS
};
enum { RP_FUNC_SPI = 1, RP_FUNC_UART, RP_FUNC_I2C, RP_FUNC_PWM, RP_FUNC_SIO };

/* A queue of bytes */
struct rp_fifo {
    uint8_t data[RP_FIFO];
    uint32_t first, count;
};

struct rp_state {
    bool is_2350;
    uint32_t n_pins, usb_irq, uart_irq, usb_reset, pwm_reset;
    uint32_t regs[RP_N_BLOCKS][160];
    uint32_t ref_hz, peri_hz, usb_hz, adc_hz;
    uint64_t xosc_ready, pll_ready[2];
    uint64_t alarm_due, watchdog_due, adc_due;
    uint64_t out, oe, told_out, told_driven;
    uint32_t pwm_told[RP_PINS][3];
};
extern struct rp_state rp;

static inline uint32_t rp_function(uint32_t pin)
{
    return rp.regs[RP_IO_BANK0][2 * pin + 1] & 31;
}

/* Is a block held in reset?  By its bit. */
static inline bool rp_in_reset(uint32_t bit)
{
    return rp.regs[RP_RESETS][0] >> bit & 1;
}

/* A word's value after a write by one of its four addresses. */
uint32_t rp_combine(uint32_t old, uint32_t value, uint32_t alias);

/* unicorn_rp2040_io.c: a block's registers, its events */
void rp_io_reset(void);
uint32_t rp_io_read(uint32_t block, uint32_t word);
void rp_io_write(uint32_t block, uint32_t word, uint32_t value);
void rp_io_run_events(void);
uint64_t rp_io_next_event(void);
uint64_t rp_uart_free_at(void);
void rp_uart_rx(uint8_t byte);
void rp_pwm_update(void);

/* unicorn_rp2040_usb.c */
void rp_usb_map(uc_engine *uc);
void rp_usb_reset(void);
bool rp_usb_is_on(void);

/* unicorn_rp2040_flash.c: the flash chip, its interface, the boot ROM */
void rp_flash_map(uc_engine *uc);
void rp_flash_boot(uint32_t start);

#endif
