/* SPDX-License-Identifier: GPL-3.0-or-later
 * The console on USB: a serial port of the communication device class (CDC ACM
 * 1.2, USB 2.0 chapter 9).
 *
 * Data is taken from the host only when there is room for a packet, so none is
 * lost.  Opening the port at 1200 baud and closing it starts the boot loader.
 */
#include <string.h>

#include "board/console.h"
#include "generic/usb_control.h"

#define RX_SIZE 192
#define TX_SIZE 160
#define TOUCH_BAUD 1200

enum {
    SET_LINE_CODING = USB_REQUEST(0x21, 0x20),
    GET_LINE_CODING = USB_REQUEST(0xa1, 0x21),
    SET_LINE_STATE = USB_REQUEST(0x21, 0x22),
};

#define CONFIG_LENGTH (9 + 9 + 5 + 4 + 5 + 7 + 9 + 7 + 7)
const ROM uint8_t usb_config_descriptor[] = {
    9, USB_DESC_CONFIG, USB_WORD(CONFIG_LENGTH), 2, 1, 0, 0xc0, 50,
    /* control: class 2, abstract control model */
    9, USB_DESC_INTERFACE, 0, 0, 1, 2, 2, 1, 0,
    5, 0x24, 0, USB_WORD(0x0110),   /* header */
    4, 0x24, 2, 6,              /* line coding and serial state */
    5, 0x24, 6, 0, 1,           /* interface 1 belongs to 0 */
    7, USB_DESC_ENDPOINT, 0x80 | USB_EP_NOTIFY, 3,
    USB_WORD(USB_NOTIFY_SIZE), 255,
    /* data */
    9, USB_DESC_INTERFACE, 1, 0, 2, 10, 0, 0, 0,
    7, USB_DESC_ENDPOINT, USB_EP_OUT, 2, USB_WORD(USB_BULK_SIZE), 0,
    7, USB_DESC_ENDPOINT, 0x80 | USB_EP_IN, 2, USB_WORD(USB_BULK_SIZE), 0,
};
const ROM uint8_t usb_config_size = sizeof(usb_config_descriptor);

static uint8_t rx_buf[RX_SIZE], tx_buf[TX_SIZE];
static uint8_t rx_len, tx_first, tx_end;
static uint8_t line_coding[7];

void usb_class_reset(void)
{
}

/* The port was closed (no terminal is ready) at the speed that nobody uses. */
static void set_line_state(uint16_t state)
{
    uint32_t baud;

    memcpy(&baud, line_coding, sizeof(baud));
    if (!(state & 1) && baud == TOUCH_BAUD)
        usb_accept_and_leave();
    else
        usb_accept();
}

bool usb_class_request(const struct usb_setup *setup)
{
    switch (USB_REQUEST(setup->type, setup->request)) {
    case GET_LINE_CODING:
        usb_reply(line_coding, sizeof(line_coding));
        return true;
    case SET_LINE_CODING:
        usb_expect(line_coding, sizeof(line_coding));
        return true;
    case SET_LINE_STATE:
        set_line_state(setup->value);
        return true;
    }
    return false;
}

void usb_class_received(const struct usb_setup *setup)
{
    (void)setup;
}

/*
 * Data
 */

static void take_packets(void)
{
    while (rx_len <= RX_SIZE - USB_BULK_SIZE) {
        int8_t n = usb_receive(&rx_buf[rx_len]);

        if (n < 0)
            return;
        rx_len = (uint8_t)(rx_len + n);
        console_note_rx();
    }
}

static void send_data(void)
{
    while (tx_first < tx_end) {
        uint8_t n = (uint8_t)(tx_end - tx_first);

        /* never a full packet: that would ask for an empty one behind it */
        if (n >= USB_BULK_SIZE)
            n = USB_BULK_SIZE - 1;
        if (!usb_send(&tx_buf[tx_first], n))
            return;
        tx_first = (uint8_t)(tx_first + n);
    }
}

void usb_cdc_task(void)
{
    uint8_t events;

    if (!sched_take(&usb_wake))
        return;
    events = usb_control_advance();
    if (usb_is_configured()) {
        take_packets();
        send_data();
        if (rx_len <= RX_SIZE - USB_BULK_SIZE)
            events |= USB_WAIT_OUT;
        if (tx_first < tx_end)
            events |= USB_WAIT_IN;
    }
    usb_wait_for(events);
}
DECL_TASK(usb_cdc_task);

uint8_t console_peek(const uint8_t **data)
{
    *data = rx_buf;
    return rx_len;
}

void console_consume(uint8_t len)
{
    rx_len = (uint8_t)(rx_len - len);
    memmove(rx_buf, &rx_buf[len], rx_len);
    sched_wake(&usb_wake);
}

uint8_t *console_reserve(uint8_t len)
{
    if (tx_first) {
        tx_end = (uint8_t)(tx_end - tx_first);
        memmove(tx_buf, &tx_buf[tx_first], tx_end);
        tx_first = 0;
    }
    return tx_end + len <= TX_SIZE ? &tx_buf[tx_end] : NULL;
}

void console_commit(uint8_t len)
{
    tx_end = (uint8_t)(tx_end + len);
    sched_wake(&usb_wake);
}
