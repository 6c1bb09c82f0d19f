/* SPDX-License-Identifier: GPL-3.0-or-later
 * Commands as a host writes them, by the name of their handler. */
#ifndef FAKEBOARD_SEND_COMMAND_H
#define FAKEBOARD_SEND_COMMAND_H

#include <stdint.h>

#include "core/command.h"

/* Number of the command with this handler; the test ends if there is none. */
uint32_t find_command(void *handler);

/* Write a command into an empty payload; returns its length. */
uint8_t put_command(uint8_t payload[COMMAND_PAYLOAD_MAX], void *handler, int n,
                    const uint32_t *values);

/* SEND(queue_step, oid, interval, count, add): what that does is up to the
 * send_values(void *handler, int n, const uint32_t *values) of the test. */
#define SEND(NAME, ...) \
    send_values((void *)command_##NAME, \
                (int)(sizeof((uint32_t[]){ __VA_ARGS__ }) / 4), \
                (uint32_t[]){ __VA_ARGS__ })

#endif
