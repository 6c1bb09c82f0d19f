/* SPDX-License-Identifier: GPL-3.0-or-later
 * The console on a usart. */
#include <string.h>

#include "board/console.h"
#include "board/irq.h"
#include "core/sched.h"
#include "serial.h"

#define RX_SIZE 192
#define TX_SIZE (CONFIG_RAM_SIZE < 2048 ? 72 : 160)

DECL_CONSTANT("RECEIVE_WINDOW", RX_SIZE);
DECL_CONSTANT("SERIAL_BAUD", CONFIG_SERIAL_BAUD);
#if CONFIG_SERIAL_PORT == 0
#if CONFIG_AVR_MEGA
DECL_CONSTANT_STR("RESERVE_PINS_serial", "PE0,PE1");
#else
DECL_CONSTANT_STR("RESERVE_PINS_serial", "PD0,PD1");
#endif
#elif CONFIG_SERIAL_PORT == 1
DECL_CONSTANT_STR("RESERVE_PINS_serial", "PD2,PD3");
#elif CONFIG_SERIAL_PORT == 2
DECL_CONSTANT_STR("RESERVE_PINS_serial", "PH0,PH1");
#else
DECL_CONSTANT_STR("RESERVE_PINS_serial", "PJ0,PJ1");
#endif

/* A chip with one usart names the vectors without a number. */
#if CONFIG_AVR_X8
#define VECTOR(NAME) USART##NAME
#else
#define VECTOR(NAME) JOIN(USART, CONFIG_SERIAL_PORT, NAME)
#endif

static uint8_t rx_buf[RX_SIZE], tx_buf[TX_SIZE];
static volatile uint8_t rx_len, tx_first, tx_end;

static inline void take_byte(void)
{
    uint8_t data = REG(UDR, ), len = rx_len;

    if (len < RX_SIZE) {
        rx_buf[len] = data;
        rx_len = (uint8_t)(len + 1);
    }
    if (data == 0x7e)
        console_note_rx();
}

ISR(VECTOR(_RX_vect))
{
    take_byte();
}

/* The chip holds no more than three bytes, which come within 120 us. */
void serial_poll(void)
{
    while (REG(UCSR, A) & (1 << REG(RXC, )))
        take_byte();
}

ISR(VECTOR(_UDRE_vect))
{
    uint8_t first = tx_first;

    if (first >= tx_end) {
        REG(UCSR, B) &= (uint8_t)~(1 << REG(UDRIE, ));
        return;
    }
    REG(UDR, ) = tx_buf[first];
    tx_first = (uint8_t)(first + 1);
}

uint8_t console_peek(const uint8_t **data)
{
    *data = rx_buf;
    return rx_len;
}

/* Bytes may arrive behind what moves, so most of it moves with irqs on. */
void console_consume(uint8_t len)
{
    uint8_t moved = 0;

    for (;;) {
        uint8_t rest = (uint8_t)(rx_len - len);

        memmove(&rx_buf[moved], &rx_buf[len + moved], (uint8_t)(rest - moved));
        moved = rest;
        irq_disable();
        if ((uint8_t)(rx_len - len) == moved)
            break;
        irq_enable();
    }
    rx_len = moved;
    irq_enable();
}

uint8_t *console_reserve(uint8_t len)
{
    irq_flag_t flag = irq_save();
    uint8_t first = tx_first, end = tx_end;
    uint8_t *room = NULL;

    if (first >= end) {
        tx_first = tx_end = end = 0;
    } else if (end + len > TX_SIZE && end - first + len <= TX_SIZE) {
        REG(UCSR, B) &= (uint8_t)~(1 << REG(UDRIE, ));
        irq_restore(flag);
        memmove(tx_buf, &tx_buf[first], (uint8_t)(end - first));
        flag = irq_save();
        tx_first = 0;
        tx_end = end = (uint8_t)(end - first);
        REG(UCSR, B) |= 1 << REG(UDRIE, );
    }
    if (end + len <= TX_SIZE)
        room = &tx_buf[end];
    irq_restore(flag);
    return room;
}

void console_commit(uint8_t len)
{
    irq_flag_t flag = irq_save();

    tx_end = (uint8_t)(tx_end + len);
    REG(UCSR, B) |= 1 << REG(UDRIE, );
    irq_restore(flag);
}

void serial_init(void)
{
    REG(UBRR, ) = (CONFIG_CLOCK_FREQ + 4L * CONFIG_SERIAL_BAUD)
        / (8L * CONFIG_SERIAL_BAUD) - 1;
    REG(UCSR, A) = 1 << REG(U2X, );
    REG(UCSR, C) = (1 << REG(UCSZ, 1)) | (1 << REG(UCSZ, 0));
    REG(UCSR, B) = (1 << REG(RXEN, )) | (1 << REG(TXEN, ))
        | (1 << REG(RXCIE, ));
}
DECL_INIT(serial_init);
