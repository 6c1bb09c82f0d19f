/* SPDX-License-Identifier: GPL-3.0-or-later
 * A CAN adapter on USB, as Linux's driver gs_usb knows it: the computer's
 * interface can0.  The mcu itself is a node of that bus.
 *
 * Frames from the computer go to the controller, those for the node only to
 * it; requests to all nodes go both ways.  Each frame comes back to the
 * computer once it has been passed on.
 */
#include <string.h>

#include "board/can.h"
#include "board/irq.h"
#include "board/timer.h"
#include "core/command.h"
#include "generic/can_node.h"
#include "generic/usb_control.h"

DECL_CONSTANT("CANBUS_BRIDGE", 1);

enum {
    SET_FORMAT = USB_REQUEST(0x41, 0), SET_BIT_TIMING = USB_REQUEST(0x41, 1),
    SET_MODE = USB_REQUEST(0x41, 2), GET_LIMITS = USB_REQUEST(0xc1, 4),
    GET_CONFIG = USB_REQUEST(0xc1, 5),
};
enum { QUEUE_SIZE = 32, NODE_RESERVE = 8, ECHO_NONE = 0xffffffff };
/* A bus that takes no frames must not keep the computer from the node */
#define HOLD_US 20000

#define CONFIG_LENGTH (9 + 9 + 7 + 7)
const ROM uint8_t usb_config_descriptor[] = {
    9, USB_DESC_CONFIG, USB_WORD(CONFIG_LENGTH), 1, 1, 0, 0xc0, 50,
    9, USB_DESC_INTERFACE, 0, 0, 2, 0xff, 0xff, 0xff, 0,
    7, USB_DESC_ENDPOINT, 0x80 | USB_EP_IN, 2, USB_WORD(USB_BULK_SIZE), 0,
    7, USB_DESC_ENDPOINT, USB_EP_OUT, 2, USB_WORD(USB_BULK_SIZE), 0,
};
const ROM uint8_t usb_config_size = sizeof(usb_config_descriptor);

/* A frame as it goes over USB */
struct gs_frame {
    uint32_t echo, id;
    uint8_t len, channel, flags, reserved;
    uint8_t data[8];
};

/* To the computer; interrupts add at the end. */
static struct gs_frame queue[QUEUE_SIZE];
static uint8_t first_queued;
static volatile uint8_t n_queued;
/* From the computer, while the controller has no room */
static struct gs_frame held;
static bool has_held;
static uint32_t held_since;
static volatile bool is_open;
static volatile bool has_discarded;
static bool was_discarding;

static struct { uint32_t mode, flags; } mode;
static uint8_t ignored[USB_EP0_SIZE];

/*
 * Control
 */

void usb_class_reset(void)
{
    is_open = false;
    n_queued = 0;
    has_held = false;
}

/* The speed of the bus is that of the build, whatever the computer says. */
bool usb_class_request(const struct usb_setup *setup)
{
    /* features, clock; least and greatest lengths: segment 1, segment 2, jump,
     * prescaler and its step */
    static const uint32_t limits[10] = { 0, 48000000, 1, 16, 1, 8, 4, 1, 1024,
                                         1 };
    /* interfaces but one; versions */
    static const uint32_t config[3] = { 0, 2, 1 };

    switch (USB_REQUEST(setup->type, setup->request)) {
    case SET_FORMAT:
    case SET_BIT_TIMING:
        usb_expect(ignored, sizeof(ignored));
        return true;
    case SET_MODE:
        usb_expect(&mode, sizeof(mode));
        return true;
    case GET_LIMITS:
        usb_reply(limits, sizeof(limits));
        return true;
    case GET_CONFIG:
        usb_reply(config, sizeof(config));
        return true;
    }
    return false;
}

void usb_class_received(const struct usb_setup *setup)
{
    if (USB_REQUEST(setup->type, setup->request) == SET_MODE)
        is_open = mode.mode != 0;
}

/*
 * To the computer
 */

static bool push(const struct can_frame *frame, uint32_t echo, uint8_t room)
{
    irq_flag_t flag = irq_save();
    uint8_t n = n_queued;
    bool fits = n + room < QUEUE_SIZE;
    struct gs_frame *gs = &queue[(first_queued + n) % QUEUE_SIZE];

    if (fits) {
        *gs = (struct gs_frame){ .echo = echo, .id = frame->id,
                                 .len = frame->len };
        memcpy(gs->data, frame->data, sizeof(gs->data));
        n_queued = (uint8_t)(n + 1);
    }
    irq_restore(flag);
    sched_wake(&usb_wake);
    return fits;
}

static void drop_first(void)
{
    irq_flag_t flag = irq_save();

    n_queued = (uint8_t)(n_queued - 1);
    first_queued = (uint8_t)((first_queued + 1) % QUEUE_SIZE);
    irq_restore(flag);
}

static void send_to_computer(void)
{
    while (n_queued) {
        const uint8_t *data = (const uint8_t *)&queue[first_queued];

        if (!usb_send(data, sizeof(queue[0])))
            return;
        drop_first();
        can_node_note_room();
    }
}

void can_note_rx(const struct can_frame *frame)
{
    if (is_open && !push(frame, ECHO_NONE, 0))
        has_discarded = true;
}

void can_note_tx(void)
{
    sched_wake(&usb_wake);
}

/* Of the node: what nobody reads is as if sent. */
bool can_node_send(const struct can_frame *frame)
{
    return !is_open || push(frame, ECHO_NONE, NODE_RESERVE);
}

static uint16_t node_can_id;

void can_node_set_filter(uint16_t id)
{
    node_can_id = id;
}

/*
 * From the computer
 */

static bool pass_on(const struct gs_frame *gs)
{
    struct can_frame frame = { .id = gs->id, .len = gs->len };
    irq_flag_t flag;

    if (frame.len > 8)
        return true;
    memcpy(frame.data, gs->data, sizeof(frame.data));
    if (frame.id != node_can_id && !can_send(&frame)
        && timer_read_clock() - held_since < timer_from_us(HOLD_US))
        return false;
    if (frame.id == CAN_ID_ADMIN || frame.id == node_can_id) {
        flag = irq_save();
        can_node_take(&frame);
        irq_restore(flag);
    }
    push(&frame, gs->echo, 0);
    return true;
}

/* There is room for what comes back, and for some of the node. */
static bool take_from_computer(void)
{
    uint8_t packet[USB_BULK_SIZE];

    while (n_queued + NODE_RESERVE < QUEUE_SIZE) {
        if (has_held && !pass_on(&held))
            return false;
        has_held = false;
        if (usb_receive(packet) < (int8_t)sizeof(held))
            return true;
        memcpy(&held, packet, sizeof(held));
        held_since = timer_read_clock();
        has_held = true;
    }
    return true;
}

static void tell_discards(void)
{
    bool is_discarding = has_discarded;

    has_discarded = false;
    if (is_discarding == was_discarding)
        return;
    was_discarding = is_discarding;
    sendf("usb_canbus_state discard=%u", is_discarding);
}

void usb_gs_task(void)
{
    uint8_t events;

    if (!sched_take(&usb_wake))
        return;
    events = usb_control_advance();
    if (usb_is_configured()) {
        /* the controller's interrupt, or time, lets it go on */
        if (!take_from_computer())
            sched_wake(&usb_wake);
        send_to_computer();
        if (n_queued + NODE_RESERVE < QUEUE_SIZE)
            events |= USB_WAIT_OUT;
        if (n_queued)
            events |= USB_WAIT_IN;
    }
    tell_discards();
    usb_wait_for(events);
}
DECL_TASK(usb_gs_task);
