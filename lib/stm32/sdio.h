/* SPDX-License-Identifier: GPL-3.0-or-later
 * SDIO of an STM32F4: RM0090, 31.9.
 */
#ifndef STM32_SDIO_H
#define STM32_SDIO_H

#include <stdint.h>

struct sdio_regs {
    volatile uint32_t POWER, CLKCR, ARG, CMD, RESPCMD, RESP[4], DTIMER, DLEN;
    volatile uint32_t DCTRL, DCOUNT, STA, ICR, MASK, reserved0[2], FIFOCNT;
    volatile uint32_t reserved1[13], FIFO;
};
#define SDIO_POWER_ON 3u
#define SDIO_CLKCR_DIV(N) ((N) - 2u)
#define SDIO_CLKCR_DIV_MAX 257u
#define SDIO_CLKCR_ENABLE (1u << 8)
#define SDIO_CLKCR_4_BITS (1u << 11)
#define SDIO_CMD_ANSWER(N) ((uint32_t)(N) << 6)
#define SDIO_CMD_START (1u << 10)
#define SDIO_DCTRL_START 1u
#define SDIO_DCTRL_FROM_CARD 2u
#define SDIO_DCTRL_SIZE(LOG2) ((uint32_t)(LOG2) << 4)
#define SDIO_STA_COMMAND_CRC (1u << 0)
#define SDIO_STA_DATA_CRC (1u << 1)
#define SDIO_STA_COMMAND_TIMEOUT (1u << 2)
#define SDIO_STA_DATA_TIMEOUT (1u << 3)
#define SDIO_STA_UNDERRUN (1u << 4)
#define SDIO_STA_OVERRUN (1u << 5)
#define SDIO_STA_ANSWERED (1u << 6)
#define SDIO_STA_SENT (1u << 7)
#define SDIO_STA_DATA_END (1u << 8)
#define SDIO_STA_START_BIT (1u << 9)
#define SDIO_STA_BLOCK_END (1u << 10)
#define SDIO_STA_TX_FULL (1u << 16)
#define SDIO_STA_RX_HAS_DATA (1u << 21)
#define SDIO_ICR_ALL 0x00c007ffu

#endif
