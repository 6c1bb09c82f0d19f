/* SPDX-License-Identifier: GPL-3.0-or-later
 * Steps that are made in the timer interrupt itself.
 *
 * What the events of stepper.c and sched_run_timer() do, in assembly. */
#ifndef AVR_STEPS_H
#define AVR_STEPS_H

#include <stdint.h>

#include "core/arena.h"
#include "core/sched.h"
#include "motion/stepper.h"
#include "serial.h"

#define US (CONFIG_CLOCK_FREQ / 1000000)
/* Events this near to each other are told apart by 16 bits */
#define REACH_TICKS 0x6000
/* A part of a burst of events: bytes do not wait longer for serial_poll() */
#define PART_TICKS (80 * US)
/* A step that is so near is waited for in run_short_steps() */
#define SHORT_WAIT_TICKS (CONFIG_HAVE_SHORT_STEPS ? 160 : 0)

/* Events that follow each other without a break: this part ends at `limit`, so
 * many come after it. */
struct burst {
    uint16_t limit;
    uint8_t parts;
};

#if CONFIG_HAVE_SHORT_STEPS
#define LONG_INTERVAL "0x28"
#define SHORT_WAIT "0x60"       /* 256 - SHORT_WAIT_TICKS */
#define REACH "0x60"            /* REACH_TICKS / 256 */
#define IS_SHORT_BIT "1"

/* Is the timer at Y, whose time is in r18 and r19, due, or so soon that it is
 * waited for?  Goes to 9f if not, to 50f after `limit`. */
#define AWAIT \
    "3:\tlds r24, %[tcnt]\n\tlds r25, %[tcnt]+1\n\tmovw r20, r24\n\t" \
    "sub r20, %A[limit]\n\tsbc r21, %B[limit]\n\tbrpl 6f\n\t" \
    "sub r24, r18\n\tsbc r25, r19\n\tbrpl 4f\n\t" \
    "cpi r25, 0xff\n\tbrne 0f\n\tcpi r24, " SHORT_WAIT "\n\tbrcc 3b\n" \
    "0:\trjmp 9f\n6:\trjmp 50f\n"

/* One step less; goes to LAST if that was the last one of the run. */
#define COUNT(LAST) \
    "4:\tldd r20, Y+%[count]\n\tldd r21, Y+%[count]+1\n\t" \
    "subi r20, 1\n\tsbci r21, 0\n\tbreq " LAST "\n\t" \
    "std Y+%[count], r20\n\tstd Y+%[count]+1, r21\n\t"

#define STEP_PIN \
    "ldd r26, Y+%[port]\n\tldd r27, Y+%[port]+1\n\tldd r20, Y+%[port]+2\n\t"
#define PULSE STEP_PIN "st X, r20\n\tinc %[made]\n\t"

/* Z: a timer in front of the new place in the list: look for it.  The timer
 * that is now the first goes to Y; goes on at 2: unless its time may be too far
 * to be told by 16 bits, then at 9f. */
#define MOVE \
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
    "movw %[hint], r28\n\tmovw r28, r20\n" \
    "25:\tcpi r23, " LONG_INTERVAL "\n\tbrcs 2f\n\t" \
    "ldd r24, Y+4\n\tldd r25, Y+5\n\tldd r20, Y+6\n\tldd r21, Y+7\n\t" \
    "sub r24, %A[since]\n\tsbc r25, %B[since]\n\tsbc r20, %C[since]\n\t" \
    "sbc r21, %D[since]\n\tor r20, r21\n\tbrne 0f\n\t" \
    "movw %[hint], r28\n\tcpi r25, " REACH "\n\tbrcs 2f\n\trjmp 9f\n" \
    /* still the first */ \
    "8:\tcpi r23, " LONG_INTERVAL "\n\tbrcc 0f\n\trjmp 3b\n0:\trjmp 9f\n2:"

/* A step of the short run at Y, and its new place in the list: from SEARCH
 * (code that leaves in Z a timer in front of that place) on. */
#define SHORT_STEP(OTHER, LAST, ALONE, PULSED, SEARCH) \
    "1:\tldd r30, Y+2\n\tldd r31, Y+3\n\tcpi r30, lo8(%[event])\n\t" \
    "ldi r24, hi8(%[event])\n\tcpc r31, r24\n\tbrne " OTHER "\n\t" \
    "ldd r18, Y+4\n\tldd r19, Y+5\n\t" ALONE \
    AWAIT COUNT(LAST) PULSE \
    PULSED "ldd r22, Y+%[interval]\n\tldd r23, Y+%[interval]+1\n\t" \
    "ldd r24, Y+6\n\tldd r25, Y+7\n\tadd r18, r22\n\tadc r19, r23\n\t" \
    "std Y+4, r18\n\tstd Y+5, r19\n\tbrcc 5f\n\t" \
    "adiw r24, 1\n\tstd Y+6, r24\n\tstd Y+7, r25\n" \
    "5:\tldd r30, Y+%[add]\n\tldd r31, Y+%[add]+1\n\t" \
    "add r30, r22\n\tadc r31, r23\n\t" \
    "std Y+%[interval], r30\n\tstd Y+%[interval]+1, r31\n\t" \
    SEARCH MOVE

/* Behind itself, which is the first of the list. */
#define FROM_FIRST "19:\tmovw r30, r28\n"
/* Behind the timer that was moved last, if that is not itself and not later:
 * with several motors at speed that is the place, or next to it.  Both were due
 * within LATE_TICKS and BURST_TICKS of each other and go on by less than
 * LONG_INTERVAL, so 16 bits tell which is later. */
#define FROM_HINT \
    "movw r30, r28\n\tcp r28, %A[hint]\n\tcpc r29, %B[hint]\n\tbreq 6f\n\t" \
    "movw r30, %[hint]\n\tldd __tmp_reg__, Z+4\n\tcp r18, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+5\n\tcpc r19, __tmp_reg__\n\tbrpl 6f\n\t" \
    "movw r30, r28\n"

/* A step of a run with intervals of any length.  From its end on the time is
 * told by more than 16 bits. */
#define LONG_STEP \
    "11:\tcpi r30, lo8(%[long_event])\n\tldi r24, hi8(%[long_event])\n\t" \
    "cpc r31, r24\n\tbreq 3f\n\trjmp 15f\n" \
    "3:\tldd r18, Y+4\n\tldd r19, Y+5\n" \
    AWAIT COUNT("12f") PULSE \
    "17:\trcall 30f\n\tldd r24, Y+6\n\tldd r25, Y+7\n\t" \
    "movw r30, r28\n\tadiw r30, %[interval]\n\t" \
    "ldd r21, Y+%[add]+1\n\t" \
    /* r22: sign of add */ \
    "mov r22, r21\n\tlsl r22\n\tsbc r22, r22\n\tldd r23, Y+%[add]\n\t" \
    "ld __tmp_reg__, Z\n\tadd r18, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+1\n\tadc r19, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+2\n\tadc r24, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+3\n\tadc r25, __tmp_reg__\n\t" \
    "ld __tmp_reg__, Z\n\tadd __tmp_reg__, r23\n\tst Z, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+1\n\tadc __tmp_reg__, r21\n\tstd Z+1, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+2\n\tadc __tmp_reg__, r22\n\tstd Z+2, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+3\n\tadc __tmp_reg__, r22\n\tstd Z+3, __tmp_reg__\n\t" \
    "ldi r23, 0xff\n\trjmp 18f\n"

/* The last step of a run: go on with the next one, if there is any. */
#define LOAD_RUN \
    "12:\tldd r30, Y+%[runs]\n\tldd r31, Y+%[runs]+1\n\tsbiw r30, 0\n\t" \
    "brne 0f\n\trjmp 40f\n0:\t" \
    PULSE \
    "14:\trcall 30f\n\tldd r30, Y+%[runs]\n\tldd r31, Y+%[runs]+1\n\t" \
    /* the direction pin, if it changes */ \
    "ldd r24, Z+%[run_dir]\n\tldd r25, Y+%[dir]\n\teor r25, r24\n\t" \
    "sbrs r25, 0\n\trjmp 13f\n\t" \
    "mov r21, r24\n\tandi r21, 1\n\tstd Y+%[dir], r21\n\t" \
    "ldd r26, Y+%[runs]+2\n\tldd r27, Y+%[runs]+2+1\n\t" \
    "ldd r21, Y+%[runs]+2+2\n\tst X, r21\n\t" STEP_PIN \
    "13:\tldi r22, lo8(%[event])\n\tldi r23, hi8(%[event])\n\t" \
    "sbrc r24, " IS_SHORT_BIT "\n\trjmp 0f\n\t" \
    "ldi r22, lo8(%[long_event])\n\tldi r23, hi8(%[long_event])\n" \
    "0:\tstd Y+2, r22\n\tstd Y+3, r23\n\t" \
    "ld r22, Z\n\tldd r23, Z+1\n\t" \
    "std Y+%[runs], r22\n\tstd Y+%[runs]+1, r23\n\t" \
    "ldd r22, Z+%[run_count]\n\tldd r23, Z+%[run_count]+1\n\t" \
    "std Y+%[count], r22\n\tstd Y+%[count]+1, r23\n\t" \
    /* its cell is free */ \
    "lds r22, %[cells]\n\tlds r23, %[cells]+1\n\t" \
    "st Z, r22\n\tstd Z+1, r23\n\t" \
    "sts %[cells], r30\n\tsts %[cells]+1, r31\n\t" \
    /* its first step, and the interval after that */ \
    "ldd r22, Z+%[run_interval]\n\tldd r23, Z+%[run_interval]+1\n\t" \
    "ldd r24, Y+6\n\tldd r25, Y+7\n\tadd r18, r22\n\tadc r19, r23\n\t" \
    "ldd __tmp_reg__, Z+%[run_interval]+2\n\tadc r24, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+%[run_interval]+3\n\tadc r25, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+%[run_add]\n\tldd r21, Z+%[run_add]+1\n\t" \
    "std Y+%[add], __tmp_reg__\n\tstd Y+%[add]+1, r21\n\t" \
    "add r22, __tmp_reg__\n\tadc r23, r21\n\t" \
    "std Y+%[interval], r22\n\tstd Y+%[interval]+1, r23\n\t" \
    "ldi r22, 0\n\tsbrc r21, 7\n\tldi r22, 0xff\n\t" \
    "ldd __tmp_reg__, Z+%[run_interval]+2\n\tadc __tmp_reg__, r22\n\t" \
    "std Y+%[interval]+2, __tmp_reg__\n\t" \
    "ldd __tmp_reg__, Z+%[run_interval]+3\n\tadc __tmp_reg__, r22\n\t" \
    "std Y+%[interval]+3, __tmp_reg__\n\t" \
    "ldd r21, Z+%[run_dir]\n\tldd r23, Z+%[run_interval]+1\n\t" \
    "sbrs r21, " IS_SHORT_BIT "\n\tldi r23, 0xff\n" \
    "18:\tstd Y+4, r18\n\tstd Y+5, r19\n\tstd Y+6, r24\n\tstd Y+7, r25\n\t" \
    "rjmp 19b\n"

/* What takes long begins here, after its own pulse: other motors whose steps
 * are due, or will be within AHEAD_OF, get their pulse first and have the rest
 * done in their turn.  r18 and r19 hold the time of this one.  Loads X and r20
 * again. */
#define AHEAD_OF "0x80"         /* 256 - 128 ticks */
#define PULSE_OTHERS \
    "30:\tld r30, Y\n\tldd r31, Y+1\n" \
    "31:\tcp r30, %A[sentinel]\n\tcpc r31, %B[sentinel]\n\tbreq 39f\n\t" \
    "ldd r24, Z+2\n\tldd r25, Z+3\n\t" \
    "ldi r20, lo8(%[pulsed])\n\tldi r21, hi8(%[pulsed])\n\t" \
    "cpi r24, lo8(%[event])\n\tldi r22, hi8(%[event])\n\t" \
    "cpc r25, r22\n\tbreq 32f\n\t" \
    "ldi r20, lo8(%[long_pulsed])\n\tldi r21, hi8(%[long_pulsed])\n\t" \
    "cpi r24, lo8(%[long_event])\n\tldi r22, hi8(%[long_event])\n\t" \
    "cpc r25, r22\n\tbrne 39f\n" \
    "32:\tldd r22, Z+4\n\tldd r23, Z+5\n\tmovw r24, r22\n\t" \
    "ldd r26, Z+6\n\tldd r27, Z+7\n\tsub r24, r18\n\tsbc r25, r19\n\t" \
    "ldd r24, Y+6\n\tsbc r26, r24\n\tldd r24, Y+7\n\tsbc r27, r24\n\t" \
    "or r26, r27\n\tbrne 39f\n\tcpi r25, " REACH "\n\tbrcc 39f\n" \
    "33:\tlds r24, %[tcnt]\n\tlds r25, %[tcnt]+1\n\t" \
    "sub r24, r22\n\tsbc r25, r23\n\tbrpl 34f\n\t" \
    "cpi r25, 0xff\n\tbrne 39f\n\tcpi r24, " AHEAD_OF "\n\tbrcc 33b\n" \
    "39:\t" STEP_PIN "ret\n" \
    "34:\tldd r26, Z+%[port]\n\tldd r27, Z+%[port]+1\n\t" \
    "ldd r24, Z+%[port]+2\n\t" \
    "st X, r24\n\tstd Z+2, r20\n\tstd Z+3, r21\n\t" \
    "ldi r24, 1\n\tstd Z+%[high], r24\n\t" \
    "ld r24, Z\n\tldd r31, Z+1\n\tmov r30, r24\n\trjmp 31b\n"

/* The turn of such a motor has come. */
#define PULSED_STEP \
    "15:\tldi r22, lo8(%[event])\n\tldi r23, hi8(%[event])\n\t" \
    "cpi r30, lo8(%[pulsed])\n\tldi r24, hi8(%[pulsed])\n\t" \
    "cpc r31, r24\n\tbreq 0f\n\t" \
    "ldi r22, lo8(%[long_event])\n\tldi r23, hi8(%[long_event])\n\t" \
    "cpi r30, lo8(%[long_pulsed])\n\tldi r24, hi8(%[long_pulsed])\n\t" \
    "cpc r31, r24\n\tbreq 0f\n\trjmp 9f\n" \
    "0:\tldd r18, Y+4\n\tldd r19, Y+5\n" \
    COUNT("0f") \
    "inc %[made]\n\tstd Y+%[high], __zero_reg__\n\t" \
    "std Y+2, r22\n\tstd Y+3, r23\n\t" STEP_PIN \
    "cpi r22, lo8(%[event])\n\tldi r24, hi8(%[event])\n\t" \
    "cpc r23, r24\n\tbreq 3f\n\trjmp 17b\n3:\trjmp 16b\n" \
    /* the last one of its run */ \
    "0:\tldd r30, Y+%[runs]\n\tldd r31, Y+%[runs]+1\n\tsbiw r30, 0\n\t" \
    "brne 3f\n\trjmp 9f\n3:\tinc %[made]\n\t" \
    "std Y+%[high], __zero_reg__\n\trjmp 14b\n"

/* The last step that a motor has: it leaves the list, unless it is alone. */
#define LAST_STEP \
    "40:\tld r30, Y\n\tldd r31, Y+1\n\t" \
    "cp r30, %A[sentinel]\n\tcpc r31, %B[sentinel]\n\tbrne 0f\n\trjmp 9f\n" \
    "0:\t" PULSE \
    "std Y+%[count], __zero_reg__\n\tstd Y+%[count]+1, __zero_reg__\n\t" \
    "sts %[first], r30\n\tsts %[first]+1, r31\n\t" \
    "rcall 30b\n\tst X, r20\n\tld r20, Y\n\tldd r21, Y+1\n\tmovw r28, r20\n\t" \
    "ldi r23, 0xff\n\trjmp 25b\n"

/* A motor that is alone in the list stays there: its data are in registers, but
 * for the upper half of its time, of which r21 counts the carries. */
#define IF_ALONE \
    "ld r30, Y\n\tldd r31, Y+1\n\tcp r30, %A[sentinel]\n\t" \
    "cpc r31, %B[sentinel]\n\tbreq 26b\n"
#define PULSE_LOOPS "11"        /* 3 cycles each, 2.5 us in all */
#define ALONE \
    "60:\tmovw %[hint], r28\n\t" STEP_PIN "clr r21\n\t" \
    "ldd r22, Y+%[interval]\n\tldd r23, Y+%[interval]+1\n\t" \
    "ldd r30, Y+%[add]\n\tldd r31, Y+%[add]+1\n\t" \
    "ldd r24, Y+%[count]\n\tldd r25, Y+%[count]+1\n\tmovw r28, r24\n" \
    "61:\tlds r24, %[tcnt]\n\tlds r25, %[tcnt]+1\n\tmovw %[prev], r24\n\t" \
    "sub %A[prev], %A[limit]\n\tsbc %B[prev], %B[limit]\n\tbrpl 63f\n\t" \
    "sub r24, r18\n\tsbc r25, r19\n\tbrpl 62f\n\t" \
    "cpi r25, 0xff\n\tbrne 63f\n\tcpi r24, " SHORT_WAIT "\n\tbrcc 61b\n" \
    "63:\trcall 65f\n\trjmp 24b\n" \
    "64:\tadiw r28, 1\n\trjmp 63b\n" \
    "62:\tsbiw r28, 1\n\tbreq 64b\n\tst X, r20\n\tinc %[made]\n\t" \
    "add r18, r22\n\tadc r19, r23\n\tadc r21, __zero_reg__\n\t" \
    "mov r25, r23\n\tadd r22, r30\n\tadc r23, r31\n\t" \
    "ldi r24, " PULSE_LOOPS "\n" \
    "66:\tdec r24\n\tbrne 66b\n\tst X, r20\n\t" \
    "cpi r25, " LONG_INTERVAL "\n\tbrcs 61b\n\trcall 65f\n\trjmp 9f\n" \
    /* write them back */ \
    "65:\tmovw r24, r28\n\tmovw r28, %[hint]\n\t" \
    "std Y+%[count], r24\n\tstd Y+%[count]+1, r25\n\t" \
    "std Y+%[interval], r22\n\tstd Y+%[interval]+1, r23\n\t" \
    "std Y+4, r18\n\tstd Y+5, r19\n\tldd r24, Y+6\n\tldd r25, Y+7\n\t" \
    "add r24, r21\n\tadc r25, __zero_reg__\n\t" \
    "std Y+6, r24\n\tstd Y+7, r25\n\tret\n"

/* The next part of a burst begins, unless it was the last one or the console
 * wants something. */
#if CONFIG_SERIAL
#define POLL_CONSOLE "lds r24, %[status]\n\tsbrc r24, 7\n\trjmp 9f\n\t"
#define STATUS [status] "i"(_SFR_MEM_ADDR(SERIAL_STATUS)),
#else
#define POLL_CONSOLE ""
#define STATUS
#endif
#define NEXT_PART \
    "50:\ttst %[parts]\n\tbrne 0f\n\trjmp 9f\n0:\t" POLL_CONSOLE \
    "dec %[parts]\n\tsubi %A[limit], lo8(-(%[part]))\n\t" \
    "sbci %B[limit], hi8(-(%[part]))\n\t" \
    "ld r30, Y\n\tldd r31, Y+1\n\tcp r30, %A[sentinel]\n\t" \
    "cpc r31, %B[sentinel]\n\tbrne 0f\n\trjmp 27b\n0:\trjmp 24b\n"

/* Make the steps that come first in the list and are due before `limit`, but
 * not the last one that a motor has.  Returns whether there was any.  What the
 * events of stepper.c and sched_run_timer() do, with the pointers in registers:
 * half the time.  Y is the frame pointer, too, where the compiler wants one: it
 * does not save that. */
static inline uint8_t run_short_steps(struct burst *burst,
                                      uint32_t since)
{
    uint8_t made = 0;
    uint16_t prev, hint;

    __asm__ volatile(
        "push r28\n\tpush r29\n\t"
        "lds r28, %[first]\n\tlds r29, %[first]+1\n\tmovw %[hint], r28\n\t"
        "rjmp 1f\n21:\trjmp 11f\n22:\trjmp 12f\n26:\trjmp 60f\n27:\t"
        SHORT_STEP("21b", "22b", IF_ALONE, "16:\t", FROM_FIRST)
        "rjmp 1f\n9:\trjmp 9f\n23:\trjmp 11f\n22:\trjmp 12f\n24:\t"
        SHORT_STEP("23b", "22b", "\n", "", FROM_HINT)
        "rjmp 1b\n9:\trjmp 9f\n"
        LONG_STEP LOAD_RUN PULSE_OTHERS PULSED_STEP LAST_STEP
        ALONE NEXT_PART
        "9:\tpop r29\n\tpop r28"
        : [made] "+r"(made), [prev] "=&r"(prev), [hint] "=&r"(hint),
          [limit] "+d"(burst->limit), [parts] "+r"(burst->parts)
        : STATUS [part] "i"(PART_TICKS), [since] "r"(since),
          [sentinel] "r"(&sched_sentinel),
          [first] "i"(&sched_first), [event] "i"(stepper_short_event),
          [long_event] "i"(stepper_inline_event),
          [pulsed] "i"(stepper_short_pulsed),
          [long_pulsed] "i"(stepper_inline_pulsed), [cells] "i"(&movecell_free),
          [tcnt] "i"(_SFR_MEM_ADDR(TCNT1)), [count] "I"(STEPPER_AT_COUNT),
          [port] "I"(STEPPER_AT_PORT), [interval] "I"(STEPPER_AT_INTERVAL),
          [add] "I"(STEPPER_AT_ADD),
          [dir] "I"(STEPPER_AT_DIR), [runs] "I"(STEPPER_AT_RUNS),
          [high] "I"(STEPPER_AT_HIGH),
          [run_interval] "I"(RUN_AT_INTERVAL), [run_add] "I"(RUN_AT_ADD),
          [run_count] "I"(RUN_AT_COUNT), [run_dir] "I"(RUN_AT_DIR)
        : "r18", "r19", "r20", "r21", "r22", "r23", "r24", "r25", "r26", "r27",
          "r28", "r29", "r30", "r31", "cc", "memory");
    return made;
}

#else
static inline uint8_t run_short_steps(struct burst *burst,
                                      uint32_t since)
{
    (void)burst;
    (void)since;
    return 0;
}
#endif

#endif
