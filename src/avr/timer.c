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
/* An event that is nearer than the way out of the interrupt and back in */
#define NEAR_TICKS 80
/* The least a compare value must lie ahead to be met */
#define AHEAD_TICKS 32
#define HOP_TICKS 0x8000
#define BURST_TICKS (100 * US)
#define PAUSE_TICKS (12 * US)
#define LATE_TICKS (1000 * US)

static volatile uint16_t overflows;
static volatile uint32_t target;

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

static void program(uint32_t clock, uint32_t now)
{
    uint32_t ahead = clock - now;

    target = clock;
    if ((int32_t)ahead < 0)
        ahead = 0;
    set_compare((uint16_t)(now + (ahead > HOP_TICKS ? HOP_TICKS : ahead)));
}

void timer_kick(uint32_t clock)
{
    program(clock, read_clock_irq());
}

ISR(TIMER1_COMPA_vect)
{
    uint32_t next = target, now = read_clock_irq(), start = now;

    for (;;) {
        int32_t ahead = (int32_t)(next - now);

        if (ahead > NEAR_TICKS) {
            program(next, now);
            return;
        }
        if (ahead <= 0) {
            if (now - start > BURST_TICKS)
                break;
            next = sched_run_timer();
        }
        now = read_clock_irq();
    }
    if (now - next > LATE_TICKS)
        sched_shutdown_late();
    program(now + PAUSE_TICKS, now);
    target = next;
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
