/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A USB host that knows one device: it enumerates that, opens its serial port,
 * and moves the bytes of the console.  Controllers are models that answer packets.
 */
#ifndef UNICORN_USBHOST_H
#define UNICORN_USBHOST_H

#include "unicorn_chip.h"

enum usb_token { TOKEN_SETUP, TOKEN_OUT, TOKEN_IN };
/* NOTHING: the device does not react at all */
enum usb_answer { ANSWER_ACK, ANSWER_NAK, ANSWER_STALL, ANSWER_NOTHING };

/* A packet: `pid` is 0 or 1 for DATA0, DATA1. */
struct usb_packet {
    uint8_t data[64];
    uint32_t len, pid;
};

/* What a controller's model provides. */
struct usb_controller {
    bool (*is_attached)(void);
    void (*reset_bus)(void);
    enum usb_answer (*transact)(enum usb_token token, uint32_t address,
                                uint32_t endpoint, struct usb_packet *packet);
};

void usbhost_start(const struct usb_controller *controller);
void usbhost_run_events(void);
uint64_t usbhost_next_event(void);
uint64_t usbhost_free_at(void);
void usbhost_rx(uint8_t byte);

#endif
