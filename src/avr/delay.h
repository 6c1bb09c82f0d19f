/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pauses in counted cycles: the clock takes longer to read than a short
 * pulse may last.
 */
#ifndef AVR_DELAY_H
#define AVR_DELAY_H

#include <avr/io.h>
#include <stdint.h>
#include <util/delay_basic.h>

/* Four cycles a pass, 65536 passes at most at once. */
static inline void avr_delay_loop(uint32_t ticks)
{
    while (ticks > 0x20000) {
        _delay_loop_2(0x8000);
        ticks -= 0x20000;
    }
    if (ticks >= 4)
        _delay_loop_2((uint16_t)(ticks >> 2));
}

/* The 16 bits that timer 1 itself counts. */
typedef uint16_t delay_stamp_t;
#define PORT_DELAY_STAMP() TCNT1
#define PORT_DELAY_LOOP_NS 1000

#define PORT_DELAY_TICKS(TICKS) do { \
    if (__builtin_constant_p(TICKS)) \
        __builtin_avr_delay_cycles(TICKS); \
    else \
        avr_delay_loop(TICKS); \
} while (0)

#endif
