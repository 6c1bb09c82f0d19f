/* SPDX-License-Identifier: GPL-3.0-or-later
 * PRU0: messages to and from a port of Linux, /dev/rpmsg_pru30.
 */
#ifndef PRU_RPMSG_H
#define PRU_RPMSG_H

#include <stdbool.h>
#include <stdint.h>

enum { RPMSG_MAX = 496 };

/* Returns when Linux is there. */
void rpmsg_open(void);

/* Bytes that have come in, up to `room`. */
uint32_t rpmsg_read(uint8_t *to, uint32_t room);

/* Send a message of 1 to RPMSG_MAX bytes; false: no buffer is free, or nobody
 * has opened the port yet. */
bool rpmsg_write(const uint8_t *from, uint32_t size);

#endif
