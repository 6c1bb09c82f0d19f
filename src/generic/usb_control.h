/* SPDX-License-Identifier: GPL-3.0-or-later
 * Control transfers and descriptors of a USB device (USB 2.0, chapter 9), and
 * what a class adds to them.
 */
#ifndef GENERIC_USB_CONTROL_H
#define GENERIC_USB_CONTROL_H

#include "board/mem.h"
#include "board/usb.h"
#include "core/sched.h"

/* bmRequestType and bRequest as one number */
#define USB_REQUEST(TYPE, CODE) ((TYPE) << 8 | (CODE))
/* Two bytes of a descriptor */
#define USB_WORD(N) (uint8_t)((N) & 0xff), (uint8_t)((N) >> 8)

enum { USB_DESC_CONFIG = 2, USB_DESC_INTERFACE = 4, USB_DESC_ENDPOINT = 5 };

/* Set by usb_note(). */
extern struct task_wake usb_wake;

/* Task: go on with a control transfer as far as possible; returns what to wait
 * for. */
uint8_t usb_control_advance(void);

/* The host has chosen the configuration: endpoints may be used. */
bool usb_is_configured(void);

/* In usb_class_request(): what follows.  Data stays where it is. */
void usb_reply(const void *data, uint8_t len);
void usb_reply_rom(const ROM uint8_t *data, uint8_t len);
void usb_expect(void *data, uint8_t max);
void usb_accept(void);
/* The same, and then start the boot loader. */
void usb_accept_and_leave(void);

/* --- The class provides --- */

extern const ROM uint8_t usb_config_descriptor[];
extern const ROM uint8_t usb_config_size;
enum { USB_CLASS_CDC = 2, USB_CLASS_INTERFACE = 0 };

/* Task: one of the class's requests; false: there is no such. */
bool usb_class_request(const struct usb_setup *setup);
/* Task: the data of a request that expected some is complete. */
void usb_class_received(const struct usb_setup *setup);
/* Irq: the bus was reset. */
void usb_class_reset(void);

#endif
