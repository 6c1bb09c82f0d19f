/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What the models of SAM3X, SAM4S, SAM4E and SAM E70 know of each other.
 */
#ifndef UNICORN_SAM_H
#define UNICORN_SAM_H

#include "unicorn_bus.h"

enum sam_kind { SAM_PMC, SAM_EFC, SAM_PIO, SAM_MATRIX, SAM_UART, SAM_ADC,
                SAM_AFEC, SAM_PWM, SAM_SPI, SAM_USART, SAM_TWI, SAM_WDT,
                SAM_RSWDT, SAM_UDP, SAM_USBHS, SAM_USBHS_CTRL,
                SAM_CAN, SAM_N_KINDS };
enum sam_line { SAM3X = LINE_H7 + 1, SAM4S, SAM4E, SAME70 };

static inline enum sam_line
sam_line(void)
{
    return (enum sam_line)(uint32_t)chip.model->line;
}

/* unicorn_sam_clock.c; the peripherals' clock is chip.bus_hz[1] */
extern const struct device_ops sam_pmc_ops, sam_efc_ops;
bool sam_has_clock(const struct device *d);
bool sam_is_on(uint32_t id);
/* Cycles of the core in one of the peripherals' clock */
uint32_t sam_divider(void);
uint32_t sam_pll_hz(void);
/* Of a programmable clock; 0 while it is off */
uint32_t sam_pck_hz(uint32_t number);

/* unicorn_sam_udp.c */
extern const struct device_ops sam_udp_ops;
bool sam_uses_usb(void);
void sam_flash_command(struct device *efc, uint32_t word);

/* unicorn_sam_usbhs.c */
extern const struct device_ops sam_usbhs_ops, sam_usbhs_ctrl_ops;
bool sam_usbhs_is_used(void);
void sam_usbhs_map(uc_engine *uc, uint32_t memory);

/* unicorn_sam_can.c */
extern const struct device_ops sam_can_ops;

/* unicorn_sam_pins.c */
extern const struct device_ops sam_pio_ops, sam_matrix_ops;
/* 0 to 3: peripheral A to D; 4: a plain input; 5: an output */
enum { SAM_INPUT = 4, SAM_OUTPUT = 5 };
uint32_t sam_function_of(uint32_t pin);

/* unicorn_sam_periph.c */
extern const struct device_ops sam_uart_ops, sam_wdt_ops, sam_rswdt_ops;
extern const struct device_ops sam_pwm_ops;
void sam_rx(uint8_t byte);
void sam_update_pwm(void);

/* unicorn_sam_adc.c */
extern const struct device_ops sam_adc_ops, sam_afec_ops;

/* unicorn_sam_buses.c */
extern const struct device_ops sam_spi_ops, sam_usart_ops, sam_twi_ops;

#endif
