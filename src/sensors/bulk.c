/* SPDX-License-Identifier: GPL-3.0-or-later
 * Sensors with many samples. */
#include <stddef.h>
#include <string.h>

#include "board/irq.h"
#include "board/timer.h"
#include "sensors/bulk.h"

static struct bulk *running; /* changes in tasks only */
static struct task_wake bulk_wake;

static bool look_event(struct timer *timer)
{
    struct bulk *bulk = CONTAINER_OF(timer, struct bulk, timer);

    if (!bulk->is_due
        && (!bulk->kind->is_ready || bulk->kind->is_ready(bulk))) {
        bulk->is_due = true;
        sched_wake(&bulk_wake);
    }
    timer->waketime += bulk->rest_ticks;
    return TIMER_AGAIN;
}

void bulk_setup(struct bulk *bulk, const ROM struct bulk_kind *kind,
                uint8_t oid)
{
    bulk->timer.event = look_event;
    bulk->kind = kind;
    bulk->oid = oid;
}

static void unlink_running(struct bulk *bulk)
{
    struct bulk **link = &running;

    while (*link && *link != bulk)
        link = &(*link)->next;
    if (*link)
        *link = bulk->next;
}

void bulk_query_at(struct bulk *bulk, uint32_t clock, uint32_t rest_ticks)
{
    sched_del_timer(&bulk->timer);
    unlink_running(bulk);
    bulk->is_running = rest_ticks != 0;
    bulk->is_due = false;
    bulk->sequence = bulk->n_overflows = bulk->n_bytes = 0;
    if (!bulk->is_running)
        return;
    bulk->next = running;
    running = bulk;
    bulk->rest_ticks = rest_ticks;
    bulk->timer.waketime = clock;
    sched_add_timer(&bulk->timer);
}

void bulk_query(struct bulk *bulk, uint32_t rest_ticks)
{
    bulk_query_at(bulk, timer_read_clock() + rest_ticks, rest_ticks);
}

static void send_data(struct bulk *bulk)
{
    sendf("sensor_bulk_data oid=%c sequence=%hu data=%*s", bulk->oid,
          bulk->sequence, bulk->n_bytes, bulk->data);
    bulk->n_bytes = 0;
    bulk->sequence++;
}

void bulk_add(struct bulk *bulk, const uint8_t *sample)
{
    uint8_t size = bulk->kind->sample_size;

    memcpy(bulk->data + bulk->n_bytes, sample, size);
    bulk->n_bytes = (uint8_t)(bulk->n_bytes + size);
    if (bulk->n_bytes + size > BULK_DATA_MAX)
        send_data(bulk);
}

void bulk_add_number(struct bulk *bulk, uint32_t number)
{
    const uint8_t sample[] = {
        (uint8_t)number, (uint8_t)(number >> 8), (uint8_t)(number >> 16),
        (uint8_t)(number >> 24),
    };

    bulk_add(bulk, sample);
}

void bulk_note_overflow(struct bulk *bulk)
{
    bulk->n_overflows++;
}

/* The host takes the middle of the query for the time at which the count was
 * right. */
void bulk_send_status(struct bulk *bulk)
{
    uint32_t clock = timer_read_clock(), end;
    uint32_t n_waiting = bulk->kind->count_waiting(bulk);

    end = timer_read_clock();
    sendf("sensor_bulk_status oid=%c clock=%u query_ticks=%u"
          " next_sequence=%hu buffered=%u possible_overflows=%hu",
          bulk->oid, clock, end - clock, bulk->sequence,
          bulk->n_bytes + n_waiting * bulk->kind->sample_size,
          bulk->n_overflows);
}

void bulk_task(void)
{
    if (!sched_take(&bulk_wake))
        return;
    for (struct bulk *bulk = running; bulk; bulk = bulk->next) {
        if (!bulk->is_due)
            continue;
        if (bulk->kind->read(bulk))
            sched_wake(&bulk_wake);
        else
            bulk->is_due = false;
    }
}
DECL_TASK(bulk_task);

/* All must be started anew. */
void bulk_shutdown(void)
{
    for (struct bulk *bulk = running; bulk; bulk = bulk->next)
        bulk->is_running = bulk->is_due = false;
    running = NULL;
}
DECL_SHUTDOWN(bulk_shutdown);
