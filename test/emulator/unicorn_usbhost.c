/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A USB host with one device on its bus (USB 2.0, chapters 8 and 9; CDC 1.2).
 */
#include <string.h>

#include "unicorn_usbhost.h"

enum { ADDRESS = 5, N_TRIES = 200, SLOT_US = 40, IDLE_US = 100,
       ATTACH_US = 500 };
#define REQUEST(TYPE, CODE, VALUE, INDEX, LENGTH) \
    { TYPE, CODE, (VALUE) & 255, (VALUE) >> 8, INDEX, 0, LENGTH, 0 }

/* What hosts ask of a new device, and what a terminal asks of a modem. */
static const uint8_t script[][8] = {
    REQUEST(0x80, 6, 0x100, 0, 64), REQUEST(0, 5, ADDRESS, 0, 0),
    REQUEST(0x80, 6, 0x100, 0, 18), REQUEST(0x80, 6, 0x200, 0, 9),
    REQUEST(0x80, 6, 0x200, 0, 255), REQUEST(0x80, 6, 0x300, 0, 255),
    REQUEST(0x80, 6, 0x301, 0, 255), REQUEST(0x80, 6, 0x302, 0, 255),
    REQUEST(0x80, 6, 0x303, 0, 255), REQUEST(0x80, 6, 0x600, 0, 10),
    REQUEST(0, 9, 1, 0, 0), REQUEST(0x80, 8, 0, 0, 1),
    REQUEST(0x80, 0, 0, 0, 2), REQUEST(0x21, 0x20, 0, 0, 7),
    REQUEST(0xa1, 0x21, 0, 0, 7), REQUEST(0x21, 0x22, 3, 0, 0),
};
/* What the driver of a CAN adapter asks in place of the last three. */
static const uint8_t can_script[][8] = {
    REQUEST(0xc1, 5, 0, 0, 12), REQUEST(0xc1, 4, 0, 0, 40),
    REQUEST(0x41, 2, 0, 0, 8),
};
static const uint8_t can_mode[8] = { 1 };
enum { CAN_FRAME_SIZE = 20 };
enum { N_REQUESTS = sizeof(script) / sizeof(script[0]),
       REFUSED = 9 };           /* a device without high speed has no such */
static const uint8_t line_coding[2][7] = {
    { 0x90, 0xd0, 0x03, 0, 0, 0, 8 }, { 0xb0, 0x04, 0, 0, 0, 0, 8 },
};

static struct {
    const struct usb_controller *controller;
    uint64_t due;
    enum { DETACHED, ATTACHED, SETUP, DATA, STATUS, RUNNING, RELEASED } state;
    uint32_t request, address, n_tries, pid;
    uint8_t setup[8];
    uint8_t got[256];
    uint32_t n_got, n_sent, speed;
    uint8_t ep_in, ep_out;
    bool is_can;                /* an adapter in place of a serial port */
    uint32_t pid_in, pid_out;
    struct usb_packet out;
    char texts[4][64];          /* strings of the device */
} host;

static bool
is_to_host(void)
{
    return host.setup[0] & 0x80 && host.setup[6];
}

/* The configuration has a serial port: find its endpoints. */
static void
read_config(void)
{
    uint32_t i = 0, class = 0, total = host.got[2] | host.got[3] << 8u;

    if (host.n_got < 9 || host.got[1] != 2 || total != host.n_got)
        chip_fault("configuration of %u bytes instead of %u", host.n_got,
                   total);
    for (; i < host.n_got && host.got[i]; i += host.got[i]) {
        const uint8_t *d = &host.got[i];

        if (d[1] == 4)
            class = d[5];
        if (d[1] == 4 && class == 255)
            host.is_can = true;
        if (d[1] != 5 || (class != 10 && class != 255))
            continue;
        if ((d[3] & 3) != 2 || d[4] != 64)
            chip_fault("endpoint %x is not for bulk data", d[2]);
        if (d[2] & 0x80)
            host.ep_in = d[2] & 15;
        else
            host.ep_out = d[2];
    }
    if (!host.ep_in || !host.ep_out)
        chip_fault("configuration without a serial port");
}

static void
read_text(uint32_t index)
{
    uint32_t i;

    if (host.n_got < 2 || host.got[0] != host.n_got || host.got[1] != 3)
        chip_fault("string %u is broken", index);
    for (i = 2; i + 1 < host.n_got && i < 2 * sizeof(host.texts[0]); i += 2)
        host.texts[index][i / 2 - 1] = (char)host.got[i];
}

/* A request is done: look at what came, go on to the next. */
static void
end_request(void)
{
    const uint8_t *s = host.setup;

    if (s[0] == 0 && s[1] == 5)
        host.address = s[2];
    if (s[1] == 6 && s[3] == 1
        && (host.n_got != 18 || host.got[0] != 18
            || (host.got[4] != 2 && host.got[4])))
        chip_fault("device descriptor of %u bytes", host.n_got);
    if (s[1] == 6 && s[3] == 2 && s[6] == 255)
        read_config();
    if (s[1] == 6 && s[3] == 3 && s[2])
        read_text(s[2]);
    if (s[1] == 0x21 && memcmp(host.got, line_coding[0], 7))
        chip_fault("the line coding was forgotten");
    if (host.is_can && s[0] == 0xc1 && s[1] == 4 && host.n_got != 40)
        chip_fault("limits of the CAN adapter: %u bytes", host.n_got);
    host.request++;
    host.state = host.request < N_REQUESTS ? SETUP : RUNNING;
    if (host.request < N_REQUESTS)
        memcpy(host.setup, host.is_can && host.request >= N_REQUESTS - 3
               ? can_script[host.request + 3 - N_REQUESTS]
               : script[host.request], 8);
    /* who closes the port sets no lines */
    if (host.speed && host.setup[1] == 0x22)
        host.setup[2] = 0;
}

/* One packet of a control transfer; NAKs come again, for a while. */
static bool
transact(enum usb_token token, struct usb_packet *packet)
{
    enum usb_answer answer = host.controller->transact(token, host.address, 0,
                                                       packet);

    if (answer == ANSWER_ACK) {
        host.n_tries = 0;
        return true;
    }
    if (answer == ANSWER_STALL && host.request == REFUSED
        && host.state != SETUP)
        end_request();
    else if (answer == ANSWER_STALL)
        chip_fault("request %x %x is refused", host.setup[0], host.setup[1]);
    else if (++host.n_tries > N_TRIES)
        chip_fault("request %x %x is not answered", host.setup[0],
                   host.setup[1]);
    return false;
}

static void
run_setup(void)
{
    struct usb_packet packet = { .len = 8, .pid = 0 };

    memcpy(packet.data, host.setup, 8);
    if (!transact(TOKEN_SETUP, &packet))
        return;
    host.pid = 1;
    host.n_got = host.n_sent = 0;
    host.state = host.setup[6] ? DATA : STATUS;
}

static void
run_data(void)
{
    struct usb_packet packet = { .len = host.setup[6], .pid = host.pid };

    if (!is_to_host()) {
        memcpy(packet.data, host.is_can ? can_mode : line_coding[host.speed],
               packet.len);
        if (transact(TOKEN_OUT, &packet))
            host.state = STATUS;
        return;
    }
    if (!transact(TOKEN_IN, &packet))
        return;
    if (packet.pid != host.pid)
        chip_fault("endpoint 0 sends the wrong DATA packet");
    host.pid ^= 1;
    memcpy(&host.got[host.n_got], packet.data, packet.len);
    host.n_got += packet.len;
    if (packet.len < 64 || host.n_got >= host.setup[6])
        host.state = STATUS;
}

static void
run_status(void)
{
    struct usb_packet packet = { .len = 0, .pid = 1 };

    if (!transact(is_to_host() ? TOKEN_OUT : TOKEN_IN, &packet))
        return;
    if (!is_to_host() && (packet.len || packet.pid != 1))
        chip_fault("a transfer ends with a packet that is not empty DATA1");
    end_request();
}

/* A packet in each direction; true if something has moved. */
static bool
run_bulk(void)
{
    struct usb_packet packet = { .len = 0 };
    bool moved = false;

    if (host.controller->transact(TOKEN_IN, host.address, host.ep_in, &packet)
        == ANSWER_ACK) {
        if (packet.pid != host.pid_in)
            chip_fault("the bulk endpoint sends the wrong DATA packet");
        host.pid_in ^= 1;
        chip.host.tx(chip.host.ctx, chip_now(), packet.data, packet.len);
        moved = true;
    }
    host.out.pid = host.pid_out;
    if (host.out.len >= (host.is_can ? CAN_FRAME_SIZE : 1)
        && host.controller->transact(
            TOKEN_OUT, host.address, host.ep_out, &host.out) == ANSWER_ACK) {
        host.pid_out ^= 1;
        host.out.len = 0;
        moved = true;
    }
    return moved;
}

static void
wait_us(uint32_t us)
{
    host.due = chip.cycle + (uint64_t)us * chip.core_hz / 1000000;
    chip_wake_at(host.due);
}

uint64_t
usbhost_next_event(void)
{
    if (!host.controller || chip.is_broken || host.state == RELEASED
        || (host.state == DETACHED && !host.controller->is_attached()))
        return NEVER;
    return host.due;
}

void
usbhost_run_events(void)
{
    bool moved = true;

    if (chip.cycle < usbhost_next_event())
        return;
    switch (host.state) {
    case DETACHED:
        host.state = ATTACHED;
        wait_us(ATTACH_US);
        return;
    case ATTACHED:
        host.controller->reset_bus();
        host.state = SETUP;
        memcpy(host.setup, script[0], 8);
        break;
    case SETUP:
        run_setup();
        break;
    case DATA:
        run_data();
        break;
    case STATUS:
        run_status();
        break;
    case RUNNING:
        moved = run_bulk();
        break;
    case RELEASED:
        return;
    }
    wait_us(moved ? SLOT_US : IDLE_US);
}

uint64_t
usbhost_free_at(void)
{
    return host.state != RUNNING || host.out.len
        == (host.is_can ? CAN_FRAME_SIZE : sizeof(host.out.data))
        ? NEVER : chip.cycle;
}

void
usbhost_rx(uint8_t byte)
{
    host.out.data[host.out.len++] = byte;
}

void
usbhost_start(const struct usb_controller *controller)
{
    memset(&host, 0, sizeof(host));
    host.controller = controller;
}

/* For tests: a string of the device, as it was read. */
const char *
unicorn_usb_text(uint32_t index)
{
    return host.texts[index & 3];
}

/* For tests: one packet of the host's own making; the answer. */
int
unicorn_usb_transact(int token, uint32_t endpoint, struct usb_packet *packet)
{
    return host.controller->transact((enum usb_token)token, host.address,
                                     endpoint, packet);
}

/* For tests: from now on another host makes all packets, on a bus that was
 * reset. */
void
unicorn_usb_release(void)
{
    host.controller->reset_bus();
    host.address = 0;
    host.state = RELEASED;
}

/* For tests: the device has taken its address from that host. */
void
unicorn_usb_set_address(uint32_t address)
{
    host.address = address;
}

/* For tests: the bus is reset, and the device is asked everything again. */
void
unicorn_usb_replug(void)
{
    host.state = ATTACHED;
    host.request = host.address = host.n_tries = 0;
    host.pid_in = host.pid_out = 0;
    host.out.len = 0;
}

/* For tests: a terminal closes the port, after it was open at 1200 baud. */
void
unicorn_usb_touch(void)
{
    static const uint8_t coding[8] = REQUEST(0x21, 0x20, 0, 0, 7);

    host.speed = 1;
    memcpy(host.setup, coding, 8);
    host.request = N_REQUESTS - 2;
    host.state = SETUP;
}
