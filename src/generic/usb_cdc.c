/* SPDX-License-Identifier: GPL-3.0-or-later
 * The console on USB: a serial port of the communication device class (CDC ACM
 * 1.2, USB 2.0 chapter 9).
 *
 * Data is taken from the host only when there is room for a packet, so none is
 * lost.  Opening the port at 1200 baud and closing it starts the boot loader.
 */
#include <string.h>

#include "board/console.h"
#include "board/mem.h"
#include "board/usb.h"
#include "core/sched.h"

#define RX_SIZE 192
#define TX_SIZE 160
#define TOUCH_BAUD 1200

enum { DESC_DEVICE = 1, DESC_CONFIG = 2, DESC_STRING = 3 };
enum { STRING_LANGUAGE, STRING_MAKER, STRING_PRODUCT, STRING_SERIAL };
/* bmRequestType and bRequest as one number */
#define REQUEST(TYPE, CODE) ((TYPE) << 8 | (CODE))
enum {
    GET_STATUS = REQUEST(0x80, 0), GET_DESCRIPTOR = REQUEST(0x80, 6),
    GET_CONFIGURATION = REQUEST(0x80, 8),
    SET_ADDRESS = REQUEST(0, 5), SET_CONFIGURATION = REQUEST(0, 9),
    SET_LINE_CODING = REQUEST(0x21, 0x20),
    GET_LINE_CODING = REQUEST(0xa1, 0x21),
    SET_LINE_STATE = REQUEST(0x21, 0x22),
};

#define WORD(N) (uint8_t)((N) & 0xff), (uint8_t)((N) >> 8)

static const ROM uint8_t device_descriptor[] = {
    18, DESC_DEVICE, WORD(0x0200), 2, 0, 0, USB_EP0_SIZE,
    WORD(CONFIG_USB_VENDOR_ID), WORD(CONFIG_USB_DEVICE_ID), WORD(0x0100),
    STRING_MAKER, STRING_PRODUCT, STRING_SERIAL, 1,
};

#define CONFIG_LENGTH (9 + 9 + 5 + 4 + 5 + 7 + 9 + 7 + 7)
static const ROM uint8_t config_descriptor[] = {
    9, DESC_CONFIG, WORD(CONFIG_LENGTH), 2, 1, 0, 0xc0, 50,
    /* control: class 2, abstract control model */
    9, 4, 0, 0, 1, 2, 2, 1, 0,
    5, 0x24, 0, WORD(0x0110),   /* header */
    4, 0x24, 2, 6,              /* line coding and serial state */
    5, 0x24, 6, 0, 1,           /* interface 1 belongs to 0 */
    7, 5, 0x80 | USB_EP_NOTIFY, 3, WORD(USB_NOTIFY_SIZE), 255,
    /* data */
    9, 4, 1, 0, 2, 10, 0, 0, 0,
    7, 5, USB_EP_OUT, 2, WORD(USB_BULK_SIZE), 0,
    7, 5, 0x80 | USB_EP_IN, 2, WORD(USB_BULK_SIZE), 0,
};

/* The path under /dev/serial/by-id is made of these. */
static const ROM char maker[] = "Klipper";
static const ROM char product[] = CONFIG_MCU;
static const ROM char serial_number[] = CONFIG_USB_SERIAL_NUMBER;

static struct task_wake wake;
static uint8_t rx_buf[RX_SIZE], tx_buf[TX_SIZE];
static uint8_t rx_len, tx_first, tx_end;
static bool is_configured;
static uint8_t line_coding[7];

/* What a control transfer still has to do. */
static struct {
    enum { IDLE, SENDING, RECEIVING, ENDING, MOVING } state;
    const ROM void *source;
    bool is_text, is_ram;       /* source: characters; not in ROM */
    bool needs_empty;           /* a last packet that is not full tells the end */
    uint8_t pos, len, whole;    /* whole: of the descriptor */
    uint8_t address;            /* to take at the end; 0: none */
} control;

void usb_note(void)
{
    sched_wake(&wake);
}

void usb_note_reset(void)
{
    is_configured = false;
    control.state = IDLE;
    sched_wake(&wake);
}

/*
 * Control transfers
 */

static uint8_t read_source(uint8_t pos)
{
    if (control.is_ram)
        return ((const uint8_t *)(uintptr_t)control.source)[pos];
    if (!control.is_text)
        return ((const ROM uint8_t *)control.source)[pos];
    if (pos < 2)
        return pos ? DESC_STRING : control.whole;
    return pos & 1 ? 0 : ((const ROM uint8_t *)control.source)[pos / 2 - 1];
}

static void start_sending(const ROM void *source, uint8_t len, uint16_t asked)
{
    control.state = SENDING;
    control.source = source;
    control.is_text = control.is_ram = false;
    control.pos = 0;
    control.len = control.whole = len;
    control.needs_empty = len < asked && len % USB_EP0_SIZE == 0;
    if (len > asked)
        control.len = (uint8_t)asked;
}

static void send_text(const ROM char *text, uint8_t size, uint16_t asked)
{
    start_sending(text, (uint8_t)(2 * size), asked);
    control.is_text = true;
}

static bool send_string(uint8_t index, uint16_t asked)
{
    static const ROM uint8_t languages[] = { 4, DESC_STRING, WORD(0x0409) };

    /* a size counts the end of the text, which makes room for the header */
    if (index == STRING_LANGUAGE)
        start_sending(languages, sizeof(languages), asked);
    else if (index == STRING_MAKER)
        send_text(maker, sizeof(maker), asked);
    else if (index == STRING_PRODUCT)
        send_text(product, sizeof(product), asked);
    else if (index == STRING_SERIAL)
        send_text(serial_number, sizeof(serial_number), asked);
    else
        return false;
    return true;
}

static bool send_descriptor(uint16_t what, uint16_t asked)
{
    uint8_t type = (uint8_t)(what >> 8);

    if (type == DESC_DEVICE)
        start_sending(device_descriptor, sizeof(device_descriptor), asked);
    else if (type == DESC_CONFIG)
        start_sending(config_descriptor, sizeof(config_descriptor), asked);
    else
        return type == DESC_STRING && send_string((uint8_t)what, asked);
    return true;
}

static void send_memory(const void *data, uint8_t len, uint16_t asked)
{
    start_sending((const ROM void *)(uintptr_t)data, len, asked);
    control.is_ram = true;
}

/* The port was closed (no terminal is ready) at the speed that nobody uses. */
static void set_line_state(uint16_t state)
{
    uint32_t baud;

    memcpy(&baud, line_coding, sizeof(baud));
    control.state = ENDING;
    if (!(state & 1) && baud == TOUCH_BAUD)
        usb_enter_bootloader();
}

static bool obey(const struct usb_setup *setup)
{
    static uint8_t status[2];

    switch (REQUEST(setup->type, setup->request)) {
    case GET_DESCRIPTOR:
        return send_descriptor(setup->value, setup->length);
    case GET_STATUS:
        status[0] = 1; /* has its own power */
        send_memory(status, 2, setup->length);
        return true;
    case GET_CONFIGURATION:
        status[0] = is_configured;
        send_memory(status, 1, setup->length);
        return true;
    case GET_LINE_CODING:
        send_memory(line_coding, sizeof(line_coding), setup->length);
        return true;
    case SET_LINE_CODING:
        control.state = RECEIVING;
        return true;
    case SET_LINE_STATE:
        set_line_state(setup->value);
        return true;
    case SET_CONFIGURATION:
        usb_set_configured();
        is_configured = true;
        control.state = ENDING;
        return true;
    case SET_ADDRESS:
        control.state = ENDING;
        control.address = (uint8_t)setup->value;
        return true;
    }
    return false;
}

static void send_packets(void)
{
    uint8_t packet[USB_EP0_SIZE], n, i;

    while (control.pos < control.len || control.needs_empty) {
        n = (uint8_t)(control.len - control.pos);
        if (n > USB_EP0_SIZE)
            n = USB_EP0_SIZE;
        for (i = 0; i < n; i++)
            packet[i] = read_source((uint8_t)(control.pos + i));
        if (!usb_ep0_send(packet, n))
            return;
        control.pos = (uint8_t)(control.pos + n);
        if (n < USB_EP0_SIZE)
            control.needs_empty = false;
    }
    control.state = IDLE;
}

/* Go on with a control transfer as far as possible. */
static void advance_control(void)
{
    struct usb_setup setup;

    if (usb_take_setup(&setup)) {
        control.state = IDLE;
        control.address = 0;
        if (!obey(&setup))
            usb_ep0_stall();
    }
    if (control.state == RECEIVING
        && usb_ep0_receive(line_coding, sizeof(line_coding)) >= 0)
        control.state = ENDING;
    if (control.state == SENDING)
        send_packets();
    if (control.state == ENDING && usb_ep0_send(line_coding, 0))
        control.state = control.address ? MOVING : IDLE;
    if (control.state == MOVING && usb_set_address(control.address))
        control.state = IDLE;
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
    uint8_t events = 0;

    if (!sched_take(&wake))
        return;
    advance_control();
    if (is_configured) {
        take_packets();
        send_data();
        if (rx_len <= RX_SIZE - USB_BULK_SIZE)
            events |= USB_WAIT_OUT;
        if (tx_first < tx_end)
            events |= USB_WAIT_IN;
    }
    if (control.state != IDLE)
        events |= USB_WAIT_EP0;
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
    sched_wake(&wake);
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
    sched_wake(&wake);
}
