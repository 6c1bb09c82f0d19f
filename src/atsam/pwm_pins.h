/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins that pwm can drive: H(port, bit, peripheral, channel) starts a cycle
 * high, L(...) is its complement.  Included once, by pwm.c.
 */
#define PIN_OF(LETTER, BIT) (((LETTER) - 'A') * 32 + (BIT))
#define H(PORT, BIT, PERIPHERAL, CHANNEL) \
    { PIN_OF(PORT, BIT), PERIPHERAL, CHANNEL, true },
#define L(PORT, BIT, PERIPHERAL, CHANNEL) \
    { PIN_OF(PORT, BIT), PERIPHERAL, CHANNEL, false },

#if CONFIG_MACH_SAM3X
#define PWM_PINS \
    L('A', 0, 'B', 3) H('A', 8, 'B', 0) H('A', 9, 'B', 3) L('A', 12, 'B', 1) \
    H('A', 13, 'B', 2) H('A', 19, 'B', 1) L('A', 20, 'B', 2) \
    L('A', 21, 'B', 0) L('B', 6, 'B', 4) L('B', 7, 'B', 5) L('B', 8, 'B', 6) \
    L('B', 9, 'B', 7) H('B', 12, 'B', 0) H('B', 13, 'B', 1) \
    H('B', 14, 'B', 2) H('B', 15, 'B', 3) L('B', 16, 'B', 0) \
    L('B', 17, 'B', 1) L('B', 18, 'B', 2) L('B', 19, 'B', 3) \
    L('C', 2, 'B', 0) H('C', 3, 'B', 0) L('C', 4, 'B', 1) H('C', 5, 'B', 1) \
    L('C', 6, 'B', 2) H('C', 7, 'B', 2) L('C', 8, 'B', 3) H('C', 9, 'B', 3) \
    H('C', 18, 'B', 6) H('C', 19, 'B', 5) H('C', 20, 'B', 4) \
    L('C', 21, 'B', 4) L('C', 22, 'B', 5) L('C', 23, 'B', 6) \
    L('C', 24, 'B', 7)
#elif CONFIG_MACH_SAME70
/* Channels 4 to 7 are those of the second unit */
#define PWM_PINS \
    H('A', 0, 'A', 0) L('A', 1, 'A', 0) H('A', 2, 'A', 1) L('A', 5, 'A', 7) \
    H('A', 7, 'B', 3) H('A', 8, 'A', 7) H('A', 11, 'B', 0) \
    H('A', 12, 'B', 1) H('A', 13, 'B', 2) H('A', 14, 'B', 3) \
    L('A', 15, 'C', 3) L('A', 16, 'C', 2) H('A', 17, 'C', 3) \
    L('A', 19, 'B', 0) L('A', 20, 'B', 1) H('A', 23, 'B', 0) \
    H('A', 24, 'B', 1) H('A', 25, 'B', 2) L('A', 30, 'A', 2) \
    H('A', 31, 'D', 6) H('B', 0, 'A', 0) H('B', 1, 'A', 1) H('B', 4, 'B', 2) \
    L('B', 5, 'B', 0) L('B', 12, 'A', 1) L('B', 13, 'A', 2) \
    L('C', 0, 'B', 0) L('C', 1, 'B', 1) L('C', 2, 'B', 2) L('C', 3, 'B', 3) \
    H('C', 13, 'B', 3) L('C', 15, 'B', 3) L('C', 18, 'B', 1) \
    H('C', 19, 'B', 2) L('C', 20, 'B', 2) H('C', 21, 'B', 3) \
    L('C', 22, 'B', 3) L('D', 0, 'B', 4) H('D', 1, 'B', 4) L('D', 2, 'B', 5) \
    H('D', 3, 'B', 5) L('D', 4, 'B', 6) H('D', 5, 'B', 6) L('D', 6, 'B', 7) \
    H('D', 7, 'B', 7) L('D', 10, 'B', 0) H('D', 11, 'B', 0) \
    H('D', 20, 'A', 0) H('D', 21, 'A', 1) H('D', 22, 'A', 2) \
    H('D', 23, 'A', 3) L('D', 24, 'A', 0) L('D', 25, 'A', 1) \
    L('D', 26, 'A', 2) L('D', 27, 'A', 3)
#else
#define PWM_COMMON \
    H('A', 0, 'A', 0) H('A', 1, 'A', 1) H('A', 2, 'A', 2) H('A', 7, 'B', 3) \
    H('A', 11, 'B', 0) H('A', 12, 'B', 1) H('A', 13, 'B', 2) \
    H('A', 14, 'B', 3) L('A', 15, 'C', 3) L('A', 16, 'C', 2) \
    H('A', 17, 'C', 3) L('A', 19, 'B', 0) L('A', 20, 'B', 1) \
    H('A', 23, 'B', 0) H('A', 24, 'B', 1) H('A', 25, 'B', 2) \
    L('A', 30, 'A', 2) H('B', 0, 'A', 0) H('B', 1, 'A', 1) H('B', 4, 'B', 2) \
    L('B', 5, 'B', 0) L('B', 12, 'A', 1) L('B', 13, 'A', 2) \
    H('B', 14, 'B', 3) L('C', 0, 'B', 0) L('C', 1, 'B', 1) L('C', 2, 'B', 2) \
    L('C', 3, 'B', 3) L('C', 13, 'B', 0) L('C', 15, 'B', 1) \
    H('C', 18, 'B', 0) H('C', 19, 'B', 1) H('C', 20, 'B', 2) \
    H('C', 21, 'B', 3) L('C', 22, 'B', 3)
#if CONFIG_MACH_SAM4S
#define PWM_PINS PWM_COMMON
#else
#define PWM_PINS PWM_COMMON \
    H('D', 20, 'A', 0) H('D', 21, 'A', 1) H('D', 22, 'A', 2) \
    H('D', 23, 'A', 3) L('D', 24, 'A', 0) L('D', 25, 'A', 1) \
    L('D', 26, 'A', 2) L('D', 27, 'A', 3)
#endif
#endif
