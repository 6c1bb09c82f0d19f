/* SPDX-License-Identifier: GPL-3.0-or-later
 * What SAM C21 and D5x/E5x have alike where the D21 differs: GCLK (DS60001479,
 * 16; DS60001507, 14), WDT (23; 20), TC of 32 bits (35; 48).
 */
#ifndef ATSAMD_NEW_H
#define ATSAMD_NEW_H

#include "atsamd/blocks.h"

#define GCLK_BASE 0x40001c00
#define GCLK_SYNCBUSY SAMD_REG32(GCLK_BASE + 0x04)
#define GCLK_GENCTRL(N) SAMD_REG32(GCLK_BASE + 0x20 + 4 * (N))
#define GCLK_GENCTRL_EN (1u << 8)
#define GCLK_GENCTRL_IDC (1u << 9)
#define GCLK_GENCTRL_DIV(N) ((uint32_t)(N) << 16)
#define GCLK_PCHCTRL(N) SAMD_REG32(GCLK_BASE + 0x80 + 4 * (N))
#define GCLK_PCHCTRL_CHEN (1u << 6)

#define WDT_BASE 0x40002000
#define WDT_CLEAR SAMD_REG8(WDT_BASE + 0x0c)
#define WDT_BUSY SAMD_REG32(WDT_BASE + 0x08)

#endif
