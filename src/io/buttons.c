/* SPDX-License-Identifier: GPL-3.0-or-later
 * Buttons and encoders: up to 8 pins, debounced, every change reported.
 *
 * A pin's level counts when two polls in a row agree.  Reports wait until the
 * host has acknowledged them and are sent again while it has not; what
 * changes while all report slots are taken shows up when one is free.
 */
#include <stdbool.h>
#include <string.h>

#include "board/gpio.h"
#include "board/irq.h"
#include "core/oid.h"
#include "core/sched.h"

enum { BUTTONS_MAX = 8, REPORTS_MAX = 8 };

struct buttons {
    struct timer timer;
    uint32_t rest_ticks;
    uint8_t n_pins, invert;
    uint8_t connected;            /* bit n: pins[n] was added */
    uint8_t last_sample, state;   /* of the last poll; as last reported */
    uint8_t resend_polls, n_left; /* polls between two sends; until the next */
    bool is_due;                  /* the task shall send */
    uint8_t n_acked, n_reports;
    uint8_t reports[REPORTS_MAX]; /* not acknowledged yet, oldest first */
    struct gpio_in pins[BUTTONS_MAX];
};

static const ROM struct oid_kind buttons_kind = { sizeof(struct buttons) };
static struct task_wake buttons_wake;

static uint8_t read_pins(const struct buttons *b)
{
    uint8_t levels = 0, mask = 1;

    for (uint8_t i = 0; i < b->n_pins; i++, mask = (uint8_t)(mask << 1))
        if ((b->connected & mask) && gpio_read(b->pins[i]))
            levels |= mask;
    return levels ^ b->invert;
}

static void request_send(struct buttons *b)
{
    b->n_left = b->resend_polls;
    b->is_due = true;
    sched_wake(&buttons_wake);
}

static bool poll_event(struct timer *timer)
{
    struct buttons *b = CONTAINER_OF(timer, struct buttons, timer);
    uint8_t sample = read_pins(b);
    uint8_t unsteady = sample ^ b->last_sample;
    uint8_t state = (uint8_t)((sample & ~unsteady) | (b->state & unsteady));

    b->last_sample = sample;
    if (state != b->state && b->n_reports < REPORTS_MAX) {
        b->reports[b->n_reports++] = b->state = state;
        request_send(b);
    } else if (b->n_reports && !--b->n_left) {
        request_send(b);
    }
    timer->waketime += b->rest_ticks;
    return TIMER_AGAIN;
}

/* A position without a pin reads low. */
void command_config_buttons(const struct args_config_buttons *args)
{
    struct buttons *b;

    if (args->button_count > BUTTONS_MAX)
        shutdown("Max of 8 buttons");
    b = oid_new(args->oid, &buttons_kind);
    b->timer.event = poll_event;
    b->n_pins = args->button_count;
}
DECL_COMMAND(command_config_buttons, "config_buttons oid=%c button_count=%c");

void command_buttons_add(const struct args_buttons_add *args)
{
    struct buttons *b = oid_lookup(args->oid, &buttons_kind);

    if (args->pos >= b->n_pins)
        shutdown("Set button past maximum button count");
    b->pins[args->pos] = gpio_setup_input(args->pin, (int8_t)args->pull_up);
    b->connected = (uint8_t)(b->connected | 1u << args->pos);
}
DECL_COMMAND(command_buttons_add,
             "buttons_add oid=%c pos=%c pin=%u pull_up=%c");

static void forget(struct buttons *b)
{
    b->n_acked = b->n_reports = 0;
    b->last_sample = b->state = 0;
    b->is_due = false;
}

/* Begin anew, with all buttons released; rest_ticks=0 stops. */
void command_buttons_query(const struct args_buttons_query *args)
{
    struct buttons *b = oid_lookup(args->oid, &buttons_kind);

    sched_del_timer(&b->timer);
    forget(b);
    if (!args->rest_ticks)
        return;
    if (!args->retransmit_count)
        shutdown("Invalid buttons retransmit count");
    b->timer.waketime = args->clock;
    b->rest_ticks = args->rest_ticks;
    b->resend_polls = args->retransmit_count;
    b->invert = args->invert;
    sched_add_timer(&b->timer);
}
DECL_COMMAND(command_buttons_query,
             "buttons_query oid=%c clock=%u rest_ticks=%u"
             " retransmit_count=%c invert=%c");

void command_buttons_ack(const struct args_buttons_ack *args)
{
    struct buttons *b = oid_lookup(args->oid, &buttons_kind);
    uint8_t count = args->count;

    irq_disable();
    if (count > b->n_reports)
        count = b->n_reports;
    b->n_reports = (uint8_t)(b->n_reports - count);
    b->n_acked = (uint8_t)(b->n_acked + count);
    memmove(b->reports, b->reports + count, b->n_reports);
    irq_enable();
}
DECL_COMMAND(command_buttons_ack, "buttons_ack oid=%c count=%c");

static void send_reports(struct buttons *b, uint8_t oid)
{
    uint8_t reports[REPORTS_MAX], n_reports, n_acked;
    bool is_due;

    irq_disable();
    is_due = b->is_due;
    b->is_due = false;
    n_acked = b->n_acked;
    n_reports = b->n_reports;
    memcpy(reports, b->reports, sizeof(reports));
    irq_enable();
    if (is_due && n_reports)
        sendf("buttons_state oid=%c ack_count=%c state=%*s", oid, n_acked,
              n_reports, reports);
}

void buttons_task(void)
{
    struct buttons *b;
    int16_t oid = -1;

    if (!sched_take(&buttons_wake))
        return;
    while ((b = oid_next(&oid, &buttons_kind)))
        send_reports(b, (uint8_t)oid);
}
DECL_TASK(buttons_task);

void buttons_shutdown(void)
{
    struct buttons *b;
    int16_t oid = -1;

    while ((b = oid_next(&oid, &buttons_kind)))
        forget(b);
}
DECL_SHUTDOWN(buttons_shutdown);
