/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A CAN bus with one node and a host (docs/internals/firmware_can.md): of the
 * frames that wait the one with the lowest id goes first and takes its time.
 */
#include <stdlib.h>
#include <string.h>

#include "unicorn_can.h"
#include "unicorn_canhost.h"

enum { ADMIN = 0x3f0, ADMIN_REPLY = 0x3f1, QUERY = 0, SET_NODE = 1,
       NEED_NODE = 0x20, DATA = 256, FRAME_BITS = 55, RETRY_US = 2000,
       IDLE_US = 20 };

/* unicorn_can.c */
uint32_t unicorn_can_bit_rate(void);
int unicorn_can_peek(struct can_frame *frame);
void unicorn_can_end(int outcome);
int unicorn_can_deliver(const struct can_frame *frame);
void unicorn_can_idle(uint32_t bits);

static struct {
    uint32_t node;              /* 0: a test keeps the bus */
    bool is_known;              /* the node has its number */
    struct can_frame out;       /* what the host sends next */
    bool has_out;
    struct can_frame moving;    /* what is on the bus */
    enum { NOBODY, HOST, NODE } sender;
    uint64_t due, ask_at;
} bus;

bool
canhost_is_used(void)
{
    return bus.node != 0;
}

void
canhost_reset(void)
{
    const char *node = getenv("UNICORN_CAN_NODE");

    memset(&bus, 0, sizeof(bus));
    bus.node = node ? (uint32_t)strtoul(node, NULL, 10) : 0;
}

static uint64_t
bit_cycles(uint32_t bits)
{
    uint32_t rate = unicorn_can_bit_rate();

    return (uint64_t)chip.core_hz * bits / (rate ? rate : 1000000);
}

static void
ask_for_nodes(void)
{
    if (bus.is_known || bus.has_out || chip.cycle < bus.ask_at)
        return;
    bus.ask_at = chip.cycle + (uint64_t)chip.core_hz / 1000000 * RETRY_US;
    bus.out = (struct can_frame) { .id = ADMIN, .len = 1, .data = { QUERY } };
    bus.has_out = true;
}

static void
give_number(const struct can_frame *reply)
{
    if (reply->len != 8 || reply->data[0] != NEED_NODE
        || reply->data[7] != SET_NODE)
        chip_fault("CAN node answers a query of %u bytes", reply->len);
    bus.out = (struct can_frame) { .id = ADMIN, .len = 8,
                                   .data = { SET_NODE } };
    memcpy(&bus.out.data[1], &reply->data[1], 6);
    bus.out.data[7] = (uint8_t)bus.node;
    bus.has_out = true;
}

/* A frame of the node has reached the host. */
static void
take_frame(const struct can_frame *frame)
{
    if (frame->id == ADMIN_REPLY)
        give_number(frame);
    else if (frame->id == DATA + 2 * bus.node + 1)
        chip.host.tx(chip.host.ctx, chip_now(), frame->data, frame->len);
    else
        chip_fault("CAN node sends as %x", frame->id);
}

/* A frame of the host has reached the node. */
static void
end_host_frame(void)
{
    if (!unicorn_can_deliver(&bus.moving))
        return;                 /* nobody is there yet: again */
    bus.has_out = false;
    if (bus.moving.id == ADMIN && bus.moving.data[0] == SET_NODE)
        bus.is_known = true;
}

static void
end_frame(void)
{
    if (bus.sender == HOST) {
        end_host_frame();
    } else if (bus.sender == NODE) {
        unicorn_can_end(CAN_SENT);
        take_frame(&bus.moving);
    }
    bus.sender = NOBODY;
}

static void
begin_frame(void)
{
    struct can_frame frame;
    bool node_wants = unicorn_can_peek(&frame);

    if (bus.has_out && (!node_wants || bus.out.id < frame.id)) {
        if (node_wants)
            unicorn_can_end(CAN_LOST);
        bus.sender = HOST;
        bus.moving = bus.out;
    } else if (node_wants) {
        bus.sender = NODE;
        bus.moving = frame;
    }
}

void
canhost_run_events(void)
{
    uint32_t idle_bits;

    if (!bus.node || chip.cycle < bus.due)
        return;
    end_frame();
    ask_for_nodes();
    begin_frame();
    if (bus.sender != NOBODY) {
        bus.due = chip.cycle + bit_cycles(FRAME_BITS + 8 * bus.moving.len);
        return;
    }
    idle_bits = unicorn_can_bit_rate() / 1000000 * IDLE_US;
    if (idle_bits)
        unicorn_can_idle(idle_bits);
    bus.due = chip.cycle + (uint64_t)chip.core_hz / 1000000 * IDLE_US;
}

uint64_t
canhost_next_event(void)
{
    return bus.node ? bus.due : NEVER;
}

/* The host's driver fills frames as full as it can. */
uint64_t
canhost_free_at(void)
{
    if (!bus.is_known || bus.sender == HOST
        || (bus.has_out && (bus.out.id == ADMIN || bus.out.len == 8)))
        return NEVER;
    return chip.cycle;
}

void
canhost_rx(uint8_t byte)
{
    if (!bus.has_out)
        bus.out = (struct can_frame) { .id = DATA + 2 * bus.node };
    bus.out.data[bus.out.len++] = byte;
    bus.has_out = true;
}
