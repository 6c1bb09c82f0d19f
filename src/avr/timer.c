/* SPDX-License-Identifier: GPL-3.0-or-later
 * The clock: timer 1 counts the cpu's cycles, its overflows are counted here.
 *
 * The compare interrupt reaches 2^16 ticks at most; a timer further ahead is
 * approached in hops of half of that.
 */
#include "board/irq.h"
#include "board/timer.h"
#include "core/sched.h"

#define US (CONFIG_CLOCK_FREQ / 1000000)
/* From a match to the first look at the counter in the interrupt, and a bit */
#define ENTRY_TICKS 96
/* An event that is nearer than the way out of the interrupt and back in */
#define NEAR_TICKS (ENTRY_TICKS + 64)
/* The least a compare value must lie ahead to be met */
#define AHEAD_TICKS 32
#define HOP_TICKS 0x8000
/* Events this near to each other are told apart by 16 bits */
#define REACH_TICKS 0x4000
#define BURST_TICKS (100 * US)
#define PAUSE_TICKS (12 * US)
#define LATE_TICKS (1000 * US)

/* Steps of other motors, inputs, outputs and bytes that come first */
DECL_CONSTANT("STEP_LATENCY_TICKS", 44 * US);

static volatile uint16_t overflows;
static volatile uint32_t target;
static volatile uint8_t is_hop;     /* the compare value is on the way only */

static uint32_t read_clock_irq(void)
{
    uint16_t low = TCNT1, high = overflows;

    if ((TIFR1 & (1 << TOV1)) && low < 0x8000)
        high++;
    return ((uint32_t)high << 16) | low;
}

uint32_t timer_read_clock(void)
{
    irq_flag_t flag = irq_save();
    uint32_t now = read_clock_irq();

    irq_restore(flag);
    return now;
}

uint32_t timer_from_us(uint32_t us)
{
    return us * US;
}

/* Interrupt at `clock`, which is at most a hop ahead.  A match that is still
 * flagged from before is taken as an interrupt that comes too early: those find
 * nothing to do.  (Clearing it here would cost more.) */
static void set_compare(uint16_t clock)
{
    OCR1A = clock;
    if ((int16_t)(clock - TCNT1) < AHEAD_TICKS)
        OCR1A = (uint16_t)(TCNT1 + AHEAD_TICKS);
}

/* Be in the interrupt, past its entry, at `clock`. */
static void program(uint32_t clock, uint32_t now)
{
    int32_t ahead = (int32_t)(clock - now) - ENTRY_TICKS;

    target = clock;
    is_hop = ahead > HOP_TICKS;
    if (ahead < 0)
        ahead = 0;
    set_compare((uint16_t)(now + (is_hop ? HOP_TICKS : (uint16_t)ahead)));
}

void timer_kick(uint32_t clock)
{
    program(clock, read_clock_irq());
}

/* Too much at once: let others run for a moment. */
static __attribute__((noinline)) void pause_burst(uint32_t next)
{
    uint32_t now = read_clock_irq();

    if ((int32_t)(now - next) > (int32_t)LATE_TICKS)
        sched_shutdown_late();
    program(now + PAUSE_TICKS, now);
    target = next;
}

static __attribute__((noinline)) void program_far(uint32_t next)
{
    program(next, read_clock_irq());
}

/* Run what is due.  From one event to the next the low half of the clock tells
 * everything. */
ISR(TIMER1_COMPA_vect)
{
    uint16_t start = TCNT1;
    uint32_t next = target, done;

    if (is_hop) {
        program_far(next);
        return;
    }
    do {
        int16_t ahead;

        while ((ahead = (int16_t)((uint16_t)next - TCNT1)) > 0) {
            if (ahead > NEAR_TICKS) {
                target = next;
                is_hop = 0;
                OCR1A = (uint16_t)next - ENTRY_TICKS;
                return;
            }
        }
        if ((uint16_t)((uint16_t)next - ahead - start) > BURST_TICKS) {
            pause_burst(next);
            return;
        }
        done = next;
        next = sched_run_timer();
    } while (next - done < REACH_TICKS);
    program_far(next);
}

ISR(TIMER1_OVF_vect)
{
    overflows++;
}

void timer_init(void)
{
    irq_flag_t flag = irq_save();

    TCCR1A = 0;
    TCCR1B = 1 << CS10;
    TCNT1 = 0;
    program(HOP_TICKS, 0);
    TIMSK1 = (1 << OCIE1A) | (1 << TOIE1);
    irq_restore(flag);
}
DECL_INIT(timer_init);
