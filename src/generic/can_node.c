/* SPDX-License-Identifier: GPL-3.0-or-later
 * The console on CAN (docs/internals/firmware_can.md).
 *
 * A host gives each node a number by its uuid; data then has the id
 * 256 + 2 * number to the node, and one more from it.
 */
#include <string.h>

#include "board/console.h"
#include "board/irq.h"
#include "board/reset.h"
#include "core/command.h"
#include "core/sched.h"
#include "generic/can_node.h"
#include "generic/can_uuid.h"

#define RX_SIZE 192
#define TX_SIZE 192
enum { CAN_ID_ADMIN_REPLY = 0x3f1, CAN_ID_DATA = 256 };
enum { QUERY_UNASSIGNED = 0x00, SET_NODE_ID = 0x01, REQUEST_BOOTLOADER = 0x02 };
enum { NEED_NODE_ID = 0x20, N_ADMIN = 4 };

DECL_CONSTANT("RECEIVE_WINDOW", RX_SIZE);

static struct task_wake wake;
static uint8_t node_id;
static uint8_t rx_buf[RX_SIZE], tx_buf[TX_SIZE];
static volatile uint8_t rx_len;
static uint8_t tx_first, tx_end;
/* Requests of the host, which a task answers */
static struct can_frame admin[N_ADMIN];
static volatile uint8_t n_admin;
static struct can_frame reply;
static bool has_reply;

uint8_t can_node_get_id(void)
{
    return node_id;
}

void can_node_note_room(void)
{
    sched_wake(&wake);
}

/*
 * What comes
 */

static void take_data(const struct can_frame *frame)
{
    uint8_t len = rx_len;

    if (frame->len > RX_SIZE - len)
        return;
    memcpy(&rx_buf[len], frame->data, frame->len);
    rx_len = (uint8_t)(len + frame->len);
    if (frame->len && memchr(frame->data, COMMAND_SYNC, frame->len))
        console_note_rx();
}

void can_node_take(const struct can_frame *frame)
{
    if (frame->id == CAN_ID_ADMIN && n_admin < N_ADMIN) {
        admin[n_admin] = *frame;
        n_admin = (uint8_t)(n_admin + 1);
        sched_wake(&wake);
    } else if (node_id && frame->id == CAN_ID_DATA + 2u * node_id) {
        take_data(frame);
    }
}

/*
 * Administration
 */

static bool is_for_us(const struct can_frame *frame)
{
    return frame->len >= 1 + CAN_UUID_SIZE
        && !memcmp(&frame->data[1], can_uuid_get(), CAN_UUID_SIZE);
}

static void answer_query(void)
{
    if (node_id)
        return;
    reply.id = CAN_ID_ADMIN_REPLY;
    reply.len = 8;
    reply.data[0] = NEED_NODE_ID;
    memcpy(&reply.data[1], can_uuid_get(), CAN_UUID_SIZE);
    reply.data[7] = SET_NODE_ID;
    has_reply = true;
}

static void set_node_id(const struct can_frame *frame)
{
    uint8_t id = frame->data[7];

    if (frame->len < 8)
        return;
    if (is_for_us(frame)) {
        node_id = id;
        can_node_set_filter((uint16_t)(CAN_ID_DATA + 2 * id));
    } else if (node_id && id == node_id) {
        node_id = 0;
        shutdown("Another CAN node assigned this ID");
    }
}

static void obey(const struct can_frame *frame)
{
    if (!frame->len)
        return;
    if (frame->data[0] == QUERY_UNASSIGNED)
        answer_query();
    else if (frame->data[0] == SET_NODE_ID)
        set_node_id(frame);
    else if (frame->data[0] == REQUEST_BOOTLOADER && is_for_us(frame))
        reset_to_bootloader();
}

static bool next_request(struct can_frame *frame)
{
    irq_flag_t flag = irq_save();
    uint8_t left = n_admin;

    if (left) {
        *frame = admin[0];
        n_admin = (uint8_t)(left - 1);
        memmove(admin, &admin[1], sizeof(admin[0]) * n_admin);
    }
    irq_restore(flag);
    return left != 0;
}

/*
 * What goes
 */

static void send_data(void)
{
    struct can_frame frame;

    while (tx_first < tx_end) {
        uint8_t n = (uint8_t)(tx_end - tx_first);

        frame.id = CAN_ID_DATA + 2u * node_id + 1;
        frame.len = n < 8 ? n : 8;
        memcpy(frame.data, &tx_buf[tx_first], frame.len);
        if (!can_node_send(&frame))
            return;
        tx_first = (uint8_t)(tx_first + frame.len);
    }
}

void can_node_task(void)
{
    struct can_frame request;

    if (!sched_take(&wake))
        return;
    while (next_request(&request))
        obey(&request);
    if (has_reply && can_node_send(&reply))
        has_reply = false;
    if (node_id)
        send_data();
    else
        tx_first = tx_end = 0;
}
DECL_TASK(can_node_task);

/*
 * The console
 */

uint8_t console_peek(const uint8_t **data)
{
    *data = rx_buf;
    return rx_len;
}

void console_consume(uint8_t len)
{
    irq_flag_t flag = irq_save();

    rx_len = (uint8_t)(rx_len - len);
    memmove(rx_buf, &rx_buf[len], rx_len);
    irq_restore(flag);
}

uint8_t *console_reserve(uint8_t len)
{
    if (tx_end + len > TX_SIZE) {
        tx_end = (uint8_t)(tx_end - tx_first);
        memmove(tx_buf, &tx_buf[tx_first], tx_end);
        tx_first = 0;
    }
    return tx_end + len <= TX_SIZE ? &tx_buf[tx_end] : NULL;
}

void console_commit(uint8_t len)
{
    tx_end = (uint8_t)(tx_end + len);
    sched_wake(&wake);
}
