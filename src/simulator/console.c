/* SPDX-License-Identifier: GPL-3.0-or-later
 * Console of the simulated mcu: a receive buffer as a real one has, and output
 * that the world takes at once. */
#include <string.h>

#include "board/console.h"
#include "core/decl.h"
#include "world.h"

#define RX_SIZE 192

DECL_CONSTANT("RECEIVE_WINDOW", RX_SIZE);
DECL_CONSTANT("SERIAL_BAUD", CONFIG_SERIAL_BAUD);

static uint8_t rx_buf[RX_SIZE], rx_len;
static uint8_t tx_buf[CONSOLE_BLOCK_MAX];

int32_t simulator_console_rx(const uint8_t *buf, uint32_t len)
{
    if (len > RX_SIZE - (uint32_t)rx_len)
        return 0;
    memcpy(&rx_buf[rx_len], buf, len);
    rx_len = (uint8_t)(rx_len + len);
    console_note_rx();
    return 1;
}

uint8_t console_peek(const uint8_t **data)
{
    *data = rx_buf;
    return rx_len;
}

void console_consume(uint8_t len)
{
    rx_len = (uint8_t)(rx_len - len);
    memmove(rx_buf, &rx_buf[len], rx_len);
}

uint8_t *console_reserve(uint8_t len)
{
    return len <= sizeof(tx_buf) ? tx_buf : NULL;
}

void console_commit(uint8_t len)
{
    simulator.host->tx(simulator.host->ctx, simulator_clock(), tx_buf, len);
}
