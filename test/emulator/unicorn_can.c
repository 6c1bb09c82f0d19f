/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The CAN controller that a program uses, as a test's bus sees it.
 */
#include <string.h>

#include "unicorn_can.h"

static struct can_controller used;

void
can_attach(const struct can_controller *controller)
{
    used = *controller;
}

uint32_t
can_bit_rate(uint32_t hz, uint32_t prescaler, uint32_t seg1, uint32_t seg2)
{
    uint32_t quanta = 1 + seg1 + seg2, point = 1000 * (1 + seg1) / quanta;

    if (point < 800 || point > 920)
        chip_fault("CAN samples a bit at %u/1000", point);
    if (quanta < 8 || quanta > 25 || hz % (prescaler * quanta))
        chip_fault("CAN has %u quanta a bit, of %u Hz / %u", quanta, hz,
                   prescaler);
    return hz / (prescaler * quanta);
}

static bool
is_on(void)
{
    return used.dev && used.is_on(used.dev);
}

/* For tests: bits a second, 0 while it takes no part. */
uint32_t
unicorn_can_bit_rate(void)
{
    return is_on() ? used.bit_rate(used.dev) : 0;
}

int
unicorn_can_peek(struct can_frame *frame)
{
    memset(frame, 0, sizeof(*frame));
    return is_on() && used.peek(used.dev, frame);
}

void
unicorn_can_end(int outcome)
{
    used.end(used.dev, (enum can_outcome)outcome);
}

/* Acknowledged? */
int
unicorn_can_deliver(const struct can_frame *frame)
{
    if (!is_on())
        return 0;
    used.deliver(used.dev, frame);
    return 1;
}

void
unicorn_can_idle(uint32_t bits)
{
    if (used.dev)
        used.idle(used.dev, bits);
}
