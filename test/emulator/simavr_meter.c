/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What an emulated AVR chip spends its time on, for tests: cycles asleep, and
 * the longest for which interrupts wait, cycle by cycle.
 *
 * A wait begins behind the instruction that forbids interrupts, or where the
 * chip begins to enter one, and ends behind the one that permits them again.
 */
#include <stdbool.h>
#include <string.h>

#include <simavr/sim_avr.h>

#include "simavr_meter.h"

enum wait { WAIT_OFF, WAIT_IRQ, N_WAITS };

static struct {
    avr_t *avr;
    uint64_t asleep, since;     /* cycles; the cycle at which a wait began */
    uint64_t longest[N_WAITS];
    enum wait kind;
    bool is_watching, is_waiting;
} meter;

void
simavr_meter_connect(avr_t *avr)
{
    memset(&meter, 0, sizeof(meter));
    meter.avr = avr;
}

void
simavr_meter_sleep(uint64_t cycles)
{
    meter.asleep += cycles;
}

static void
begin_wait(enum wait kind)
{
    meter.is_waiting = true;
    meter.kind = kind;
    meter.since = meter.avr->cycle;
}

void
simavr_meter_enter(void)
{
    if (meter.is_watching)
        begin_wait(WAIT_IRQ);
}

bool
simavr_meter_is_watching(void)
{
    return meter.is_watching;
}

void
simavr_meter_look(void)
{
    uint64_t cycles = meter.avr->cycle - meter.since;

    if (!meter.avr->sreg[S_I]) {
        if (!meter.is_waiting)
            begin_wait(WAIT_OFF);
        return;
    }
    if (meter.is_waiting && cycles > meter.longest[meter.kind])
        meter.longest[meter.kind] = cycles;
    meter.is_waiting = false;
}

/* Cycles that the processor was awake, since power came on. */
uint64_t simavr_read_awake(void);
uint64_t
simavr_read_awake(void)
{
    return meter.avr->cycle - meter.asleep;
}

/* Longest waits since the last call, in cycles: while interrupts are off outside
 * of any, and for another.  The first call begins to watch, which takes time. */
void simavr_read_delays(uint64_t *delays);
void
simavr_read_delays(uint64_t *delays)
{
    memcpy(delays, meter.longest, sizeof(meter.longest));
    memset(meter.longest, 0, sizeof(meter.longest));
    meter.is_watching = true;
    meter.is_waiting = false;
}
