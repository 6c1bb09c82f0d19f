/* SPDX-License-Identifier: GPL-3.0-or-later
 * What both kinds of I2C masters share.
 */
#ifndef STM32_I2C_PINS_H
#define STM32_I2C_PINS_H

#include <stdbool.h>
#include "board/i2c.h"

/* A byte with its acknowledgement may take 50 us a bit. */
#define I2C_BYTE_TIMEOUT_US 450

/* Task: give the bus its clock and pins; shutdown("Unsupported i2c bus") if
 * there is none. */
i2c_regs_t *i2c_open(uint32_t bus);

/* Task: wait until a bit of `bits` is set in a status register; false when
 * that takes too long. */
bool i2c_wait_for(volatile uint32_t *reg, uint32_t bits);

#endif
