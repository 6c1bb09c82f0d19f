/* SPDX-License-Identifier: GPL-3.0-or-later
 * The clock: timer 1 counts the cpu's cycles, its overflows are counted here.
 *
 * The compare interrupt reaches 2^16 ticks at most; a timer further ahead is
 * approached in hops of half of that.
 */
#include "board/irq.h"
#include "board/timer.h"
#include "core/sched.h"
#include "motion/stepper.h"

#define US (CONFIG_CLOCK_FREQ / 1000000)
/* From a match to the first look at the counter in the interrupt, and a bit */
#define ENTRY_TICKS 96
/* An event that is nearer than the way out of the interrupt and back in */
#define NEAR_TICKS (ENTRY_TICKS + 64)
/* The least a compare value must lie ahead to be met */
#define AHEAD_TICKS 32
#define HOP_TICKS 0x8000
/* Events this near to each other are told apart by 16 bits */
#define REACH_TICKS 0x6000
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

#if CONFIG_HAVE_SHORT_STEPS
/* One step of the short run at Y, and its new place in the list: from SEARCH
 * (code that leaves in Z a timer in front of that place) on.  Goes to 9f if
 * there is none to make now, or if a time may be too far to be told by 16 bits;
 * else falls through with the next timer in Y. */
#define LONG_INTERVAL "0x28"
#define MAKE_STEP(SEARCH) \
    /* a short run? */ \
    "1:\tldd r30, Y+2\n\tldd r31, Y+3\n\tcpi r30, lo8(%[event])\n\t" \
    "ldi r24, hi8(%[event])\n\tcpc r31, r24\n\tbrne 0f\n\t" \
    /* due, or so soon that it is waited for? */ \
    "ldd r18, Y+4\n\tldd r19, Y+5\n" \
    "3:\tlds r24, %[tcnt]\n\tlds r25, %[tcnt]+1\n\tmovw r20, r24\n\t" \
    "sub r20, %A[limit]\n\tsbc r21, %B[limit]\n\tbrpl 0f\n\t" \
    "sub r24, r18\n\tsbc r25, r19\n\tbrpl 4f\n\t" \
    "cpi r25, 0xff\n\tbrne 0f\n\tcpi r24, 0x60\n\tbrcc 3b\n" \
    "0:\trjmp 9f\n" \
    /* one step less, its time, the next interval */ \
    "4:\tldd r20, Y+%[count]\n\tldd r21, Y+%[count]+1\n\t" \
    "subi r20, 1\n\tsbci r21, 0\n\tbreq 0b\n\t" \
    "std Y+%[count], r20\n\tstd Y+%[count]+1, r21\n\t" \
    "ldd r26, Y+%[port]\n\tldd r27, Y+%[port]+1\n\tldd r20, Y+%[bit]\n\t" \
    "st X, r20\n\tinc %[made]\n\t" \
    "ldd r22, Y+%[interval]\n\tldd r23, Y+%[interval]+1\n\t" \
    "ldd r24, Y+6\n\tldd r25, Y+7\n\tadd r18, r22\n\tadc r19, r23\n\t" \
    "std Y+4, r18\n\tstd Y+5, r19\n\tbrcc 5f\n\t" \
    "adiw r24, 1\n\tstd Y+6, r24\n\tstd Y+7, r25\n" \
    "5:\tldd r30, Y+%[add]\n\tldd r31, Y+%[add]+1\n\t" \
    "add r30, r22\n\tadc r31, r23\n\t" \
    "std Y+%[interval], r30\n\tstd Y+%[interval]+1, r31\n\t" \
    SEARCH \
    /* behind which timer? */ \
    "6:\tmovw %[prev], r30\n\tld __tmp_reg__, Z\n\tldd r31, Z+1\n\t" \
    "mov r30, __tmp_reg__\n\t" \
    "cp r30, %A[sentinel]\n\tcpc r31, %B[sentinel]\n\tbreq 7f\n\t" \
    "ldd __tmp_reg__, Z+4\n\tcp r18, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+5\n\tcpc r19, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+6\n\tcpc r24, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+7\n\tcpc r25, __tmp_reg__\n\tbrpl 6b\n" \
    "7:\tst X, r20\n\tmovw r26, %[prev]\n\t" \
    "cp r26, r28\n\tcpc r27, r29\n\tbreq 8f\n\t" \
    "ld r20, Y\n\tldd r21, Y+1\n\t" \
    "sts %[first], r20\n\tsts %[first]+1, r21\n\t" \
    "st Y, r30\n\tstd Y+1, r31\n\tst X+, r28\n\tst X, r29\n\t" \
    "movw %[hint], r28\n\tmovw r28, r20\n\t" \
    "cpi r23, " LONG_INTERVAL "\n\tbrcs 2f\n\trjmp 9f\n" \
    /* still the first */ \
    "8:\tcpi r23, " LONG_INTERVAL "\n\tbrcc 0f\n\trjmp 3b\n0:\trjmp 9f\n2:"

/* Behind itself, which is the first of the list. */
#define FROM_FIRST "movw r30, r28\n"
/* Behind the timer that was moved last, if that is not itself and not later:
 * with several motors at speed that is the place, or next to it.  Both were due
 * within LATE_TICKS and BURST_TICKS of each other and go on by less than
 * LONG_INTERVAL, so 16 bits tell which is later. */
#define FROM_HINT \
    "movw r30, r28\n\tcp r28, %A[hint]\n\tcpc r29, %B[hint]\n\tbreq 6f\n\t" \
    "movw r30, %[hint]\n\tldd __tmp_reg__, Z+4\n\tcp r18, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+5\n\tcpc r19, __tmp_reg__\n\tbrpl 6f\n\t" \
    "movw r30, r28\n"

/* Make the steps of short runs that come first in the list and are due before
 * `limit`, but not the last step of a run.  Returns whether there was any.
 * What stepper_short_event() and sched_run_timer() do, with the pointers in
 * registers: half the time.  A motor that is alone stays in the first part. */
static inline uint8_t run_short_steps(uint16_t limit)
{
    uint8_t made = 0;
    uint16_t prev, hint;

    __asm__ volatile(
        "lds r28, %[first]\n\tlds r29, %[first]+1\n"
        MAKE_STEP(FROM_FIRST)
        "rjmp 1f\n9:\trjmp 9f\n"
        MAKE_STEP(FROM_HINT)
        "rjmp 1b\n9:"
        : [made] "+r"(made), [prev] "=&r"(prev), [hint] "=&r"(hint)
        : [limit] "r"(limit), [sentinel] "r"(&sched_sentinel),
          [first] "i"(&sched_first), [event] "i"(stepper_short_event),
          [tcnt] "i"(_SFR_MEM_ADDR(TCNT1)), [count] "I"(STEPPER_AT_COUNT),
          [port] "I"(STEPPER_AT_PORT), [bit] "I"(STEPPER_AT_BIT),
          [interval] "I"(STEPPER_AT_INTERVAL), [add] "I"(STEPPER_AT_ADD)
        : "r18", "r19", "r20", "r21", "r22", "r23", "r24", "r25", "r26", "r27",
          "r28", "r29", "r30", "r31", "cc", "memory");
    return made;
}
#else
static inline uint8_t run_short_steps(uint16_t limit)
{
    (void)limit;
    return 0;
}
#endif

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
        if (!run_short_steps((uint16_t)(start + BURST_TICKS)))
            sched_run_timer();
        next = sched_first->waketime;
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
