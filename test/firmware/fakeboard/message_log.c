/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the firmware said during a job, and whether it can be true. */
#include <string.h>

#include "core/command.h"
#include "fakeboard.h"
#include "message_log.h"
#include "tests.h"

enum { MAX_VALUES = 8 };

static struct message_log *current;
static struct {
    bool is_expected, both_edges;
    uint8_t oid, step_pin, dir_pin;
    int32_t before;
} position;

/* Steps made so far, by the levels at the pins. */
static int32_t count_steps(void)
{
    uint8_t dir = 0, level = 0;
    int32_t steps = 0;

    for (uint32_t i = 0; i < fake.n_edges; i++) {
        const struct fake_edge *edge = &fake.edges[i];
        if (edge->pin == position.dir_pin)
            dir = edge->level;
        if (edge->pin != position.step_pin || edge->level == level)
            continue;
        level = edge->level;
        if (level || position.both_edges)
            steps += dir ? 1 : -1;
    }
    return steps;
}

void message_log_expect_position(uint8_t oid, uint8_t step_pin,
                                 uint8_t dir_pin, bool both_edges)
{
    position.is_expected = true;
    position.oid = oid;
    position.step_pin = step_pin;
    position.dir_pin = dir_pin;
    position.both_edges = both_edges;
    position.before = count_steps();
}

static void check_position(uint32_t oid, int32_t value)
{
    int32_t after = count_steps();

    CHECK(oid == position.oid);
    if (value != position.before && value != after) {
        fprintf(stderr, "stepper %u is said to be at %d, not %d or %d\n", oid,
                value, position.before, after);
        exit(1);
    }
    position.is_expected = false;
}

/* Integers of a message; its number is the first. */
static int decode(const uint8_t *payload, uint8_t len, uint32_t *values)
{
    const uint8_t *p = payload, *end = payload + len;
    int n = 0;

    while (p < end && n < MAX_VALUES && command_get_int(&p, end, &values[n]))
        n++;
    return n;
}

/* Numbers of the messages: those of the first two answers. */
static uint32_t state_id, position_id;

static void note_message(const uint8_t *payload, uint8_t len)
{
    uint32_t values[MAX_VALUES] = { 0 };
    int n = decode(payload, len, values);

    if (!position_id)
        position_id = values[0];
    else if (!state_id)
        state_id = values[0];
    if (position.is_expected && n == 3 && values[0] == position_id)
        check_position(values[1], (int32_t)values[2]);
    if (current->is_over) {
        CHECK(current->n_replies < LOG_MAX_REPLIES);
        memcpy(current->replies[current->n_replies++], payload, len);
    } else if (n >= 3 && values[0] == state_id && !values[2]) {
        current->n_finals++;
    }
}

void message_log_start(struct message_log *log)
{
    memset(log, 0, sizeof(*log));
    current = log;
    fake.note_message = note_message;
}
