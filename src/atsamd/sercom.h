/* SPDX-License-Identifier: GPL-3.0-or-later
 * SERCOM units: each is a usart, an SPI or an I2C master, on pins that the host
 * chooses.
 */
#ifndef ATSAMD_SERCOM_H
#define ATSAMD_SERCOM_H

#include <stdint.h>
#include "port.h"

enum sercom_role { SERCOM_TX, SERCOM_RX, SERCOM_CLK, SERCOM_ROLES };

#define SERCOM_NO_PAD 0xff

/* Task or start: registers of a unit that gets its clocks, reset and off; NULL
 * without such a unit. */
struct sercom_regs *sercom_open(uint32_t unit);

/* Number of its interrupt (of the first of four where there are so many). */
uint32_t sercom_irq(uint32_t unit);

/* Task: `pin` becomes this unit's; returns its pad, SERCOM_NO_PAD if the pin
 * has none of this unit. */
uint8_t sercom_connect(uint32_t unit, uint32_t pin, int8_t pull);

/* Task: the same for a pin that the host has named for this role. */
uint8_t sercom_connect_role(uint32_t unit, enum sercom_role role, int8_t pull);

#endif
