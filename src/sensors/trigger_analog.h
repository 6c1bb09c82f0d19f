/* SPDX-License-Identifier: GPL-3.0-or-later
 * Triggers on a sensor's readings: load cells, eddy currents.
 *
 * A sensor hands over every reading; while homing, it is filtered and
 * compared.  A reading out of range, a filter overflow, or a sensor that falls
 * silent stops the machine just as a trigger does, with another reason.
 */
#ifndef SENSORS_TRIGGER_ANALOG_H
#define SENSORS_TRIGGER_ANALOG_H

#include <stdint.h>

struct trigger_analog;

#if CONFIG_WANT_TRIGGER_ANALOG

/* Task: the object of config_trigger_analog. */
struct trigger_analog *trigger_analog_lookup(uint8_t oid);

/* Task, or irq with irqs off; `trigger` may be NULL.  A reading of now. */
void trigger_analog_update(struct trigger_analog *trigger, int32_t reading);

/* The same for a reading that failed; `error` is the sensor's own number. */
void trigger_analog_note_error(struct trigger_analog *trigger, uint8_t error);

#else

static inline void trigger_analog_update(struct trigger_analog *trigger,
                                         int32_t reading)
{
    (void)trigger;
    (void)reading;
}

static inline void trigger_analog_note_error(struct trigger_analog *trigger,
                                             uint8_t error)
{
    (void)trigger;
    (void)error;
}

#endif

#endif
