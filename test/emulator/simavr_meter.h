/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the adapter tells simavr_meter.c.
 */
#ifndef SIMAVR_METER_H
#define SIMAVR_METER_H

#include <stdbool.h>
#include <stdint.h>
#include <simavr/sim_avr.h>

/* Power came on. */
void simavr_meter_connect(avr_t *avr);

/* So many cycles passed asleep. */
void simavr_meter_sleep(uint64_t cycles);

/* The chip begins to enter an interrupt. */
void simavr_meter_enter(void);

/* True while each instruction has to be followed by simavr_meter_look(). */
bool simavr_meter_is_watching(void);
void simavr_meter_look(void);

#endif
