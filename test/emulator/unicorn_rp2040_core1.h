/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The second core of an RP2040 or RP2350, its queues, and the first PIO block.
 */
#ifndef UNICORN_RP2040_CORE1_H
#define UNICORN_RP2040_CORE1_H

#include "unicorn_rp2040.h"

void core1_map(uc_engine *uc);
void core1_reset(void);
/* Both have come as far as the first core. */
void core1_run_events(void);
uint64_t core1_next_event(void);
/* SIO's registers of the queues, as the first core sees them */
uint32_t core1_fifo_read(uint32_t word);
void core1_fifo_write(uint32_t word, uint32_t value);

#endif
