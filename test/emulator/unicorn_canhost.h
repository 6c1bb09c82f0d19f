/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A CAN bus with one node and a host, which gives the node a number and moves
 * the bytes of its console.  Only where UNICORN_CAN_NODE names that number;
 * otherwise a test keeps the bus.
 */
#ifndef UNICORN_CANHOST_H
#define UNICORN_CANHOST_H

#include <stdbool.h>
#include <stdint.h>

bool canhost_is_used(void);
void canhost_reset(void);
void canhost_run_events(void);
uint64_t canhost_next_event(void);
uint64_t canhost_free_at(void);
void canhost_rx(uint8_t byte);

#endif
