/* SPDX-License-Identifier: GPL-3.0-or-later
 * The clock: timer 1 counts the cpu's cycles, its overflows are counted here.
 *
 * The compare interrupt reaches 2^16 ticks at most; a timer further ahead is
 * approached in hops of half of that; the last one ends long before it.
 */
#include "board/irq.h"
#include "board/timer.h"
#include "core/arena.h"
#include "core/sched.h"
#include "motion/stepper.h"
#include "serial.h"
#include "steps.h"

/* From a match to the first look at the counter in the interrupt, and a bit */
#define ENTRY_TICKS 160
/* From the last look at it to the end of the interrupt */
#define EXIT_TICKS 80
/* An event that is nearer than the way out of the interrupt, some time for what
 * has a lower priority, and the way back in */
#define NEAR_TICKS (ENTRY_TICKS + EXIT_TICKS + 64)
/* The least a compare value must lie ahead to be met */
#define AHEAD_TICKS 32
#define HOP_TICKS 0x7000L
/* So many parts has a burst, then all else has its turn for a moment */
#define N_PARTS 5
#define PAUSE_TICKS (EXIT_TICKS + 100)
#define LATE_TICKS (int16_t)(1000 * US)

/* Steps of other motors and bytes that come first */
DECL_CONSTANT("STEP_LATENCY_TICKS", 25 * US);

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
 * flagged from before would bring the interrupt back at once, too early;
 * waiting there for the event would flag the match once more, and so on:
 * nothing of lower priority would ever run. */
static void set_compare(uint16_t clock)
{
    OCR1A = clock;
    TIFR1 = 1 << OCF1A;
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
    else if (ahead > HOP_TICKS + HOP_TICKS / 2)
        ahead = HOP_TICKS;
    else if (is_hop)
        ahead = HOP_TICKS / 2;
    set_compare((uint16_t)(now + (uint16_t)ahead));
}

void timer_kick(uint32_t clock)
{
    program(clock, read_clock_irq());
}

static __attribute__((noinline)) void program_far(uint32_t next)
{
    program(next, read_clock_irq());
}

/* Too much at once: let others run for a moment. */
static __attribute__((noinline)) void pause_burst(uint32_t next)
{
    uint16_t now = TCNT1;

    if ((int16_t)(now - (uint16_t)next) > LATE_TICKS)
        sched_shutdown_late();
    OCR1A = now + PAUSE_TICKS;
    TIFR1 = 1 << OCF1A;
    target = next;
    is_hop = 0;
}

/* Run what is due.  From one event to the next the low half of the clock tells
 * everything. */
ISR(TIMER1_COMPA_vect)
{
    struct burst burst = { (uint16_t)(TCNT1 + PART_TICKS), N_PARTS - 1 };
    uint32_t next = target, done;

    if (is_hop) {
        program_far(next);
        return;
    }
    do {
        int16_t ahead;

        while ((ahead = (int16_t)((uint16_t)next - TCNT1)) > SHORT_WAIT_TICKS) {
            if (ahead > NEAR_TICKS) {
                target = next;
                is_hop = 0;
                OCR1A = (uint16_t)next - ENTRY_TICKS;
                TIFR1 = 1 << OCF1A;
                return;
            }
        }
        if ((int16_t)((uint16_t)next - (uint16_t)ahead - burst.limit) >= 0) {
            serial_poll();
            if (!burst.parts) {
                pause_burst(next);
                return;
            }
            burst.parts--;
            burst.limit = (uint16_t)(burst.limit + PART_TICKS);
        }
        done = next;
        if (!run_short_steps(&burst, next)) {
            while ((int16_t)((uint16_t)next - TCNT1) > 0)
                ;
            sched_run_timer();
        }
        next = sched_first->waketime;
    } while (next - done < REACH_TICKS);
    program_far(next);
}

#if CONFIG_HAVE_SLOW_EVENTS
#define STEPS_ONLY ((1 << OCIE1A) | (1 << TOIE1))

bool timer_lock_slow(void)
{
    bool was_locked = !(TIMSK1 & (1 << OCIE1B));

    TIMSK1 = STEPS_ONLY;
    __asm__ volatile("" ::: "memory");
    return was_locked;
}

/* From now to `clock`, as far as the compare value reaches. */
static uint16_t limit_ahead(uint32_t clock)
{
    int32_t ahead = (int32_t)(clock - timer_read_clock());

    if (ahead > HOP_TICKS)
        return HOP_TICKS;
    return ahead < AHEAD_TICKS ? AHEAD_TICKS : (uint16_t)ahead;
}

/* Irqs off. */
static inline void program_slow(uint16_t ahead)
{
    OCR1B = (uint16_t)(TCNT1 + ahead);
    TIFR1 = 1 << OCF1B;
    TIMSK1 = STEPS_ONLY | (1 << OCIE1B);
}

void timer_unlock_slow(uint32_t clock)
{
    uint16_t ahead = limit_ahead(clock);
    irq_flag_t flag = irq_save();

    program_slow(ahead);
    irq_restore(flag);
}

/* Events that may be interrupted by steps.  Hops find nothing to do. */
ISR(TIMER1_COMPB_vect)
{
    uint16_t ahead;

    timer_lock_slow();
    irq_enable();
    sched_run_slow();
    ahead = limit_ahead(sched_slow_clock());
    irq_disable();
    program_slow(ahead);
}
#endif

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
    TIMSK1 = (1 << OCIE1A) | (1 << TOIE1)
        | (CONFIG_HAVE_SLOW_EVENTS ? 1 << OCIE1B : 0);
    irq_restore(flag);
}
DECL_INIT(timer_init);
