/* SPDX-License-Identifier: GPL-3.0-or-later
 * Control transfers and descriptors of a USB device (USB 2.0, chapter 9).
 */
#include "board/chipid.h"
#include "generic/usb_control.h"

enum { DESC_DEVICE = 1, DESC_STRING = 3 };
enum { STRING_LANGUAGE, STRING_MAKER, STRING_PRODUCT, STRING_SERIAL };
enum {
    GET_STATUS = USB_REQUEST(0x80, 0), GET_DESCRIPTOR = USB_REQUEST(0x80, 6),
    GET_CONFIGURATION = USB_REQUEST(0x80, 8),
    SET_ADDRESS = USB_REQUEST(0, 5), SET_CONFIGURATION = USB_REQUEST(0, 9),
};

static const ROM uint8_t device_descriptor[] = {
    18, DESC_DEVICE, USB_WORD(0x0200),
    CONFIG_USBCANBUS ? USB_CLASS_INTERFACE : USB_CLASS_CDC, 0, 0, USB_EP0_SIZE,
    USB_WORD(CONFIG_USB_VENDOR_ID), USB_WORD(CONFIG_USB_DEVICE_ID),
    USB_WORD(0x0100), STRING_MAKER, STRING_PRODUCT, STRING_SERIAL, 1,
};

/* The path under /dev/serial/by-id is made of these. */
static const ROM char maker[] = "Klipper";
static const ROM char product[] = CONFIG_MCU;
#if !CONFIG_USB_SERIAL_NUMBER_CHIPID
static const ROM char serial_number[] = CONFIG_USB_SERIAL_NUMBER;
#endif

struct task_wake usb_wake;
static bool is_configured;

/* What a control transfer still has to do. */
static struct {
    enum { IDLE, SENDING, RECEIVING, ENDING, MOVING, LEAVING } state;
    bool leaves;                /* at the end, for the boot loader */
    struct usb_setup setup;
    const ROM void *source;
    void *target;
    /* source: bytes, bytes in RAM, characters, digits of the bytes */
    enum { FROM_ROM, FROM_RAM, FROM_TEXT, FROM_ID } kind;
    bool needs_empty;           /* a packet that is not full tells the end */
    uint8_t pos, len, whole;    /* whole: of the descriptor */
    uint8_t address;            /* to take at the end; 0: none */
} control;

#define NOTHING ((const uint8_t *)&control.setup)

void usb_note(void)
{
    sched_wake(&usb_wake);
}

void usb_note_reset(void)
{
    is_configured = false;
    control.state = IDLE;
    usb_class_reset();
    sched_wake(&usb_wake);
}

bool usb_is_configured(void)
{
    return is_configured;
}

/*
 * What is sent
 */

static uint8_t read_digit(const uint8_t *id, uint8_t pos)
{
    uint8_t nibble = pos & 1 ? id[pos / 2] & 15 : id[pos / 2] >> 4;

    return (uint8_t)(nibble + (nibble < 10 ? '0' : 'A' - 10));
}

static uint8_t read_source(uint8_t pos)
{
    const uint8_t *ram = (const uint8_t *)(uintptr_t)control.source;

    if (control.kind == FROM_RAM)
        return ram[pos];
    if (control.kind == FROM_ROM)
        return ((const ROM uint8_t *)control.source)[pos];
    if (pos < 2)
        return pos ? DESC_STRING : control.whole;
    if (pos & 1)
        return 0;
    pos = (uint8_t)(pos / 2 - 1);
    if (CONFIG_USB_SERIAL_NUMBER_CHIPID && control.kind == FROM_ID)
        return read_digit(ram, pos);
    return ((const ROM uint8_t *)control.source)[pos];
}

static void start_sending(const ROM void *source, uint8_t len)
{
    uint16_t asked = control.setup.length;

    control.state = SENDING;
    control.source = source;
    control.kind = FROM_ROM;
    control.pos = 0;
    control.len = control.whole = len;
    control.needs_empty = len < asked && len % USB_EP0_SIZE == 0;
    if (len > asked)
        control.len = (uint8_t)asked;
}

void usb_reply_rom(const ROM uint8_t *data, uint8_t len)
{
    start_sending(data, len);
}

void usb_reply(const void *data, uint8_t len)
{
    start_sending((const ROM void *)(uintptr_t)data, len);
    control.kind = FROM_RAM;
}

void usb_expect(void *data, uint8_t max)
{
    control.state = RECEIVING;
    control.target = data;
    control.len = max;
}

void usb_accept(void)
{
    control.state = ENDING;
}

void usb_accept_and_leave(void)
{
    control.state = ENDING;
    control.leaves = true;
}

/* `size` counts the end of the text, which makes room for the header. */
static void send_text(const ROM char *text, uint8_t size)
{
    start_sending(text, (uint8_t)(2 * size));
    control.kind = FROM_TEXT;
}

static void send_serial_number(void)
{
#if CONFIG_USB_SERIAL_NUMBER_CHIPID
    uint8_t len;
    const uint8_t *id = chipid_get(&len);

    start_sending((const ROM void *)(uintptr_t)id, (uint8_t)(4 * len + 2));
    control.kind = FROM_ID;
#else
    send_text(serial_number, sizeof(serial_number));
#endif
}

static bool send_string(uint8_t index)
{
    static const ROM uint8_t languages[] = { 4, DESC_STRING, USB_WORD(0x0409) };

    if (index == STRING_LANGUAGE)
        start_sending(languages, sizeof(languages));
    else if (index == STRING_MAKER)
        send_text(maker, sizeof(maker));
    else if (index == STRING_PRODUCT)
        send_text(product, sizeof(product));
    else if (index == STRING_SERIAL)
        send_serial_number();
    else
        return false;
    return true;
}

static bool send_descriptor(uint16_t what)
{
    uint8_t type = (uint8_t)(what >> 8);

    if (type == DESC_DEVICE)
        start_sending(device_descriptor, sizeof(device_descriptor));
    else if (type == USB_DESC_CONFIG)
        start_sending(usb_config_descriptor, usb_config_size);
    else
        return type == DESC_STRING && send_string((uint8_t)what);
    return true;
}

/*
 * Transfers
 */

static void configure(uint8_t value)
{
    is_configured = value != 0;
    if (is_configured)
        usb_set_configured();
    control.state = ENDING;
}

static bool obey(const struct usb_setup *setup)
{
    static uint8_t status[2];

    switch (USB_REQUEST(setup->type, setup->request)) {
    case GET_DESCRIPTOR:
        return send_descriptor(setup->value);
    case GET_STATUS:
        status[0] = 1; /* has its own power */
        usb_reply(status, 2);
        return true;
    case GET_CONFIGURATION:
        status[0] = is_configured;
        usb_reply(status, 1);
        return true;
    case SET_CONFIGURATION:
        configure((uint8_t)setup->value);
        return true;
    case SET_ADDRESS:
        control.state = ENDING;
        control.address = (uint8_t)setup->value;
        return true;
    }
    return usb_class_request(setup);
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

static void receive_packet(void)
{
    if (usb_ep0_receive(control.target, control.len) < 0)
        return;
    control.state = ENDING;
    usb_class_received(&control.setup);
}

/* The empty packet that ends a transfer; and what is to happen once the host
 * has fetched it. */
static void end_transfer(void)
{
    if (control.state == ENDING && usb_ep0_send(NOTHING, 0))
        control.state = control.leaves ? LEAVING
            : control.address ? MOVING : IDLE;
    if (control.state == MOVING && usb_set_address(control.address))
        control.state = IDLE;
    /* that another would have room tells it */
    if (control.state == LEAVING && usb_ep0_send(NOTHING, 0))
        usb_enter_bootloader();
}

uint8_t usb_control_advance(void)
{
    if (usb_take_setup(&control.setup)) {
        control.state = IDLE;
        control.address = 0;
        control.leaves = false;
        if (!obey(&control.setup))
            usb_ep0_stall();
    }
    if (control.state == RECEIVING)
        receive_packet();
    if (control.state == SENDING)
        send_packets();
    end_transfer();
    return control.state == IDLE ? 0 : USB_WAIT_EP0;
}
