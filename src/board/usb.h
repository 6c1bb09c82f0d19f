/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: a USB device controller, on which src/generic/usb_cdc.c is a
 * serial port and src/generic/usb_gs.c a CAN adapter (src/Makefile adds them).
 *
 * The port's interrupt may mask itself and call usb_note(); the task then asks
 * all functions below and ends with usb_wait_for(), which unmasks.
 */
#ifndef BOARD_USB_H
#define BOARD_USB_H

#include <stdbool.h>
#include <stdint.h>
#include "port.h"

/* Endpoints, and the most bytes of a packet of each.  A CAN adapter has no
 * USB_EP_NOTIFY; its numbers are those that drivers expect.  A port whose
 * endpoint 3 cannot be it says so in its port.h. */
#ifndef USB_EP_IN_NUMBER
#define USB_EP_IN_NUMBER 3
#endif
#if CONFIG_USBCANBUS
enum { USB_EP_IN = 1, USB_EP_OUT = 2, USB_EP_COUNT = 3 };
#else
enum { USB_EP_NOTIFY = 1, USB_EP_OUT = 2, USB_EP_IN = USB_EP_IN_NUMBER,
       USB_EP_COUNT = 4 };
#endif
/* A port whose endpoint 0 is smaller says so in its port.h. */
#ifndef USB_EP0_SIZE
#define USB_EP0_SIZE 64
#endif
enum { USB_NOTIFY_SIZE = 8, USB_BULK_SIZE = 64 };

struct usb_setup {
    uint8_t type, request;
    uint16_t value, index, length;
} __attribute__((packed));

/* --- The port provides; all are called by tasks and never wait --- */

/* A setup packet has arrived: take it.  What is left of an older control
 * transfer is void. */
bool usb_take_setup(struct usb_setup *setup);

/* Next packet of a control transfer to the host; false: not yet. */
bool usb_ep0_send(const uint8_t *data, uint8_t len);

/* The packet of a control transfer from the host: its length, -1 without. */
int8_t usb_ep0_receive(uint8_t *data, uint8_t max);

/* Refuse the request. */
void usb_ep0_stall(void);

/* Take an address once the host has fetched the last packet; false: not yet. */
bool usb_set_address(uint8_t address);
/* From now on all endpoints exist. */
void usb_set_configured(void);

/* A packet from the host (room for USB_BULK_SIZE), -1 if there is none. */
int8_t usb_receive(uint8_t *data);
/* A packet to the host; false: the last one is still under way. */
bool usb_send(const uint8_t *data, uint8_t len);

/* Call usb_note() once one of these can go on. */
enum { USB_WAIT_EP0 = 1, USB_WAIT_OUT = 2, USB_WAIT_IN = 4 };
void usb_wait_for(uint8_t events);

/* Start the boot loader, which takes new firmware. */
void usb_enter_bootloader(void);

/* --- The core provides --- */

/* Any context: an event that was waited for, or a setup packet. */
void usb_note(void);

/* Irq: the host has reset the bus. */
void usb_note_reset(void);

#endif
