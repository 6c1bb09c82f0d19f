/* SPDX-License-Identifier: GPL-3.0-or-later
 * The packet memory of the full-speed USB device: a table of buffers, and
 * these.  The processor sees it as halfwords, of an F103 in every second one;
 * of a G0 as words.
 */
#ifndef STM32_USB_MEMORY_H
#define STM32_USB_MEMORY_H

#include <stdint.h>

/* Describe the buffers of an endpoint. */
void usb_memory_place(uint32_t ep);
/* Bytes of the packet that has arrived. */
uint32_t usb_memory_count(uint32_t ep);
void usb_memory_read(uint32_t ep, uint8_t *data, uint32_t len);
/* The next packet to send. */
void usb_memory_write(uint32_t ep, const uint8_t *data, uint32_t len);

#endif
