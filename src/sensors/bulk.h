/* SPDX-License-Identifier: GPL-3.0-or-later
 * Sensors with many samples, sent to the host in numbered messages.
 *
 * A timer asks every rest_ticks whether the sensor has something; a task then
 * reads it.  The host finds each sample's time from its number, so none may
 * be left out unnoticed.
 */
#ifndef SENSORS_BULK_H
#define SENSORS_BULK_H

#include <stdbool.h>
#include <stdint.h>
#include "board/mem.h"
#include "core/sched.h"

enum { BULK_DATA_MAX = 51 };

struct bulk;

struct bulk_kind {
    uint8_t sample_size;

    /* Irq: does the sensor have something?  NULL: ask it in the task. */
    bool (*is_ready)(struct bulk *bulk);

    /* Task: read a few samples; true to be called again soon. */
    bool (*read)(struct bulk *bulk);

    /* Task: samples that wait in the sensor, for bulk_send_status(). */
    uint16_t (*count_waiting)(struct bulk *bulk);
};

struct bulk {
    struct timer timer;
    struct bulk *next;      /* of the running ones */
    const ROM struct bulk_kind *kind;
    uint32_t rest_ticks;
    uint16_t sequence;      /* of the next message */
    uint16_t n_overflows;
    uint8_t oid;
    bool is_running;
    volatile bool is_due;
    uint8_t n_bytes;
    uint8_t data[BULK_DATA_MAX];
};

/* Task: prepare, as part of the object `oid`. */
void bulk_setup(struct bulk *bulk, const ROM struct bulk_kind *kind,
                uint8_t oid);

/* Task: start from sequence number 0, the first look after rest_ticks; 0 stops
 * and drops what has not been sent. */
void bulk_query(struct bulk *bulk, uint32_t rest_ticks);

/* The same with the clock of the first look. */
void bulk_query_at(struct bulk *bulk, uint32_t clock, uint32_t rest_ticks);

/* Task: one more sample; sends a message when no other would fit. */
void bulk_add(struct bulk *bulk, const uint8_t *sample);

/* Task: add a number, lowest byte first (sample_size 4). */
void bulk_add_number(struct bulk *bulk, uint32_t number);

/* Task: samples may have been lost. */
void bulk_note_overflow(struct bulk *bulk);

/* Task: send sensor_bulk_status. */
void bulk_send_status(struct bulk *bulk);

#endif
