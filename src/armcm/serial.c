/* SPDX-License-Identifier: GPL-3.0-or-later
 * The console on a serial line: bytes between interrupts and tasks.
 *
 * Both buffers are straight: what is left over moves to the front, which is
 * little and quick.
 */
#include <string.h>

#include "armcm/serial.h"
#include "board/console.h"
#include "board/irq.h"
#include "core/command.h"
#include "core/sched.h"

#define RX_SIZE 192
#define TX_SIZE 192

DECL_CONSTANT("RECEIVE_WINDOW", RX_SIZE);
DECL_CONSTANT("SERIAL_BAUD", CONFIG_SERIAL_BAUD);

struct queue {
    volatile uint8_t first, end;
    uint8_t data[RX_SIZE];
};

static struct queue rx, tx;

void serial_note_byte(uint8_t data)
{
    uint8_t end = rx.end;

    if (end < RX_SIZE) {
        rx.data[end] = data;
        rx.end = (uint8_t)(end + 1);
    }
    if (data == COMMAND_SYNC)
        console_note_rx();
}

bool serial_next_byte(uint8_t *data)
{
    uint8_t first = tx.first;

    if (first == tx.end)
        return false;
    *data = tx.data[first];
    tx.first = (uint8_t)(first + 1);
    return true;
}

/* Irqs off: what is left begins at the front again. */
static void close_up(struct queue *queue)
{
    uint8_t left = (uint8_t)(queue->end - queue->first);

    memmove(queue->data, &queue->data[queue->first], left);
    queue->first = 0;
    queue->end = left;
}

uint8_t console_peek(const uint8_t **data)
{
    *data = rx.data;
    return rx.end;
}

void console_consume(uint8_t len)
{
    irq_flag_t flag = irq_save();

    rx.first = len;
    close_up(&rx);
    irq_restore(flag);
}

uint8_t *console_reserve(uint8_t len)
{
    irq_flag_t flag = irq_save();
    uint8_t *room = NULL;

    if (tx.end + len > TX_SIZE)
        close_up(&tx);
    if (tx.end + len <= TX_SIZE)
        room = &tx.data[tx.end];
    irq_restore(flag);
    return room;
}

void console_commit(uint8_t len)
{
    irq_flag_t flag = irq_save();

    tx.end = (uint8_t)(tx.end + len);
    serial_start_tx();
    irq_restore(flag);
}
