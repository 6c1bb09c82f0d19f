/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What the models of an LPC176x know of each other.
 */
#ifndef UNICORN_LPC_H
#define UNICORN_LPC_H

#include "unicorn_bus.h"

enum lpc_kind { LPC_SYSCON, LPC_PINS, LPC_GPIO, LPC_UART, LPC_ADC, LPC_PWM,
                LPC_SSP, LPC_I2C, LPC_WDT, LPC_USB, LPC_USB_CLOCK,
                LPC_CAN, LPC_CANAF, LPC_CAN_TABLE, LPC_N_KINDS };

/* unicorn_lpc_clock.c */
extern const struct device_ops lpc_syscon_ops;
bool lpc_has_clock(const struct device *d);
/* Cycles of the core in one of a peripheral's clock */
uint32_t lpc_divider(const struct device *d);

bool lpc_has_usb_clock(void);   /* PLL1 gives 48 MHz */

/* unicorn_lpc_usb.c */
extern const struct device_ops lpc_usb_ops, lpc_usb_clock_ops;
bool lpc_uses_usb(void);        /* the device is on the bus */

/* unicorn_lpc_pins.c */
extern const struct device_ops lpc_pins_ops, lpc_gpio_ops;
uint32_t lpc_function_of(uint32_t pin);

/* unicorn_lpc_uart.c */
extern const struct device_ops lpc_uart_ops;
void lpc_rx(uint8_t byte);

/* unicorn_lpc_periph.c */
extern const struct device_ops lpc_adc_ops, lpc_pwm_ops, lpc_wdt_ops;
/* The function of a pin has changed. */
void lpc_update_pwm(void);

/* unicorn_lpc_buses.c */
extern const struct device_ops lpc_ssp_ops, lpc_i2c_ops;

/* unicorn_lpc_can.c */
extern const struct device_ops lpc_can_ops, lpc_canaf_ops, lpc_can_table_ops;

#endif
