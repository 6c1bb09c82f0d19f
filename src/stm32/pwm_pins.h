/* SPDX-License-Identifier: GPL-3.0-or-later
 * Channels of timers by pin: RM0008, 9.3 and data sheets, table of alternate
 * functions.  Included once, by pwm.c.
 *
 * TIMERS(X): X(number, where its clock comes from)
 * CHANNELS(X): X(pin, timer, channel 1 to 4, function or remap)
 */
#if CONFIG_MACH_STM32F1
/* The remap is a field of AFIO_MAPR that says where all channels are. */
#define TIMERS(X) X(1, 2) X(2, 1) X(3, 1) X(4, 1)
#define CHANNELS(X) \
    X(GPIO('A', 8), 1, 1, 0) X(GPIO('A', 9), 1, 2, 0) \
    X(GPIO('A', 10), 1, 3, 0) X(GPIO('A', 11), 1, 4, 0) \
    X(GPIO('E', 9), 1, 1, 3) X(GPIO('E', 11), 1, 2, 3) \
    X(GPIO('E', 13), 1, 3, 3) X(GPIO('E', 14), 1, 4, 3) \
    X(GPIO('A', 0), 2, 1, 0) X(GPIO('A', 1), 2, 2, 0) \
    X(GPIO('A', 2), 2, 3, 0) X(GPIO('A', 3), 2, 4, 0) \
    X(GPIO('A', 15), 2, 1, 3) X(GPIO('B', 3), 2, 2, 3) \
    X(GPIO('B', 10), 2, 3, 3) X(GPIO('B', 11), 2, 4, 3) \
    X(GPIO('A', 6), 3, 1, 0) X(GPIO('A', 7), 3, 2, 0) \
    X(GPIO('B', 0), 3, 3, 0) X(GPIO('B', 1), 3, 4, 0) \
    X(GPIO('C', 6), 3, 1, 3) X(GPIO('C', 7), 3, 2, 3) \
    X(GPIO('C', 8), 3, 3, 3) X(GPIO('C', 9), 3, 4, 3) \
    X(GPIO('B', 6), 4, 1, 0) X(GPIO('B', 7), 4, 2, 0) \
    X(GPIO('B', 8), 4, 3, 0) X(GPIO('B', 9), 4, 4, 0) \
    X(GPIO('D', 12), 4, 1, 1) X(GPIO('D', 13), 4, 2, 1) \
    X(GPIO('D', 14), 4, 3, 1) X(GPIO('D', 15), 4, 4, 1)

#elif CONFIG_STM32_F2F4F7
#define TIMERS_COMMON(X) \
    X(1, 2) X(2, 1) X(3, 1) X(4, 1) X(5, 1) X(9, 2) X(10, 2) X(11, 2)
#define CHANNELS_COMMON(X) \
    X(GPIO('A', 8), 1, 1, 1) X(GPIO('A', 9), 1, 2, 1) \
    X(GPIO('A', 10), 1, 3, 1) X(GPIO('A', 11), 1, 4, 1) \
    X(GPIO('E', 9), 1, 1, 1) X(GPIO('E', 11), 1, 2, 1) \
    X(GPIO('E', 13), 1, 3, 1) X(GPIO('E', 14), 1, 4, 1) \
    X(GPIO('A', 5), 2, 1, 1) X(GPIO('A', 15), 2, 1, 1) \
    X(GPIO('B', 3), 2, 2, 1) X(GPIO('B', 10), 2, 3, 1) \
    X(GPIO('B', 11), 2, 4, 1) \
    X(GPIO('A', 6), 3, 1, 2) X(GPIO('A', 7), 3, 2, 2) \
    X(GPIO('B', 0), 3, 3, 2) X(GPIO('B', 1), 3, 4, 2) \
    X(GPIO('B', 4), 3, 1, 2) X(GPIO('B', 5), 3, 2, 2) \
    X(GPIO('C', 6), 3, 1, 2) X(GPIO('C', 7), 3, 2, 2) \
    X(GPIO('C', 8), 3, 3, 2) X(GPIO('C', 9), 3, 4, 2) \
    X(GPIO('B', 6), 4, 1, 2) X(GPIO('B', 7), 4, 2, 2) \
    X(GPIO('B', 8), 4, 3, 2) X(GPIO('B', 9), 4, 4, 2) \
    X(GPIO('D', 12), 4, 1, 2) X(GPIO('D', 13), 4, 2, 2) \
    X(GPIO('D', 14), 4, 3, 2) X(GPIO('D', 15), 4, 4, 2) \
    X(GPIO('A', 0), 5, 1, 2) X(GPIO('A', 1), 5, 2, 2) \
    X(GPIO('A', 2), 5, 3, 2) X(GPIO('A', 3), 5, 4, 2) \
    X(GPIO('E', 5), 9, 1, 3) X(GPIO('E', 6), 9, 2, 3)
#if CONFIG_MACH_STM32F401
#define TIMERS(X) TIMERS_COMMON(X)
#define CHANNELS(X) CHANNELS_COMMON(X)
#else
#define TIMERS(X) TIMERS_COMMON(X) X(12, 1) X(13, 1) X(14, 1)
#define CHANNELS(X) CHANNELS_COMMON(X) \
    X(GPIO('F', 6), 10, 1, 3) X(GPIO('F', 7), 11, 1, 3) \
    X(GPIO('B', 14), 12, 1, 9) X(GPIO('B', 15), 12, 2, 9) \
    X(GPIO('F', 8), 13, 1, 9) X(GPIO('F', 9), 14, 1, 9)
#endif

#elif CONFIG_MACH_STM32F0
#define CHANNELS_SMALL(X) \
    X(GPIO('A', 4), 14, 1, 4) X(GPIO('B', 8), 16, 1, 2) \
    X(GPIO('B', 9), 17, 1, 2)
#if CONFIG_STM32_CLOCK_CHAINED
#define TIMERS(X) X(14, 1) X(15, 1) X(16, 1) X(17, 1)
#define CHANNELS(X) CHANNELS_SMALL(X) \
    X(GPIO('A', 6), 16, 1, 5) X(GPIO('A', 7), 17, 1, 5) \
    X(GPIO('B', 1), 14, 1, 0) \
    X(GPIO('B', 14), 15, 1, 1) X(GPIO('B', 15), 15, 2, 1)
#else
#define TIMERS(X) X(1, 1) X(3, 1) X(14, 1) X(16, 1) X(17, 1)
#define CHANNELS(X) CHANNELS_SMALL(X) \
    X(GPIO('A', 8), 1, 1, 2) X(GPIO('A', 9), 1, 2, 2) \
    X(GPIO('A', 10), 1, 3, 2) X(GPIO('A', 11), 1, 4, 2) \
    X(GPIO('A', 6), 3, 1, 1) X(GPIO('A', 7), 3, 2, 1) \
    X(GPIO('B', 0), 3, 3, 1) X(GPIO('B', 1), 3, 4, 1) \
    X(GPIO('B', 4), 3, 1, 1) X(GPIO('B', 5), 3, 2, 1) \
    X(GPIO('C', 6), 3, 1, 0) X(GPIO('C', 7), 3, 2, 0) \
    X(GPIO('C', 8), 3, 3, 0) X(GPIO('C', 9), 3, 4, 0)
#endif

#elif CONFIG_MACH_STM32G0
#define CHANNELS_SMALL(X) \
    X(GPIO('A', 4), 14, 1, 4) X(GPIO('B', 8), 16, 1, 2) \
    X(GPIO('B', 9), 17, 1, 2) X(GPIO('D', 0), 16, 1, 2) \
    X(GPIO('D', 1), 17, 1, 2) \
    X(GPIO('B', 14), 15, 1, 5) X(GPIO('B', 15), 15, 2, 5)
#if CONFIG_STM32_CLOCK_CHAINED
#define TIMERS(X) X(14, 1) X(15, 1) X(16, 1) X(17, 1)
#define CHANNELS(X) CHANNELS_SMALL(X) \
    X(GPIO('A', 6), 16, 1, 5) X(GPIO('A', 7), 17, 1, 5) \
    X(GPIO('B', 1), 14, 1, 0)
#else
#define TIMERS(X) X(1, 1) X(3, 1) X(14, 1) X(15, 1) X(16, 1) X(17, 1)
#define CHANNELS(X) CHANNELS_SMALL(X) \
    X(GPIO('A', 8), 1, 1, 2) X(GPIO('A', 9), 1, 2, 2) \
    X(GPIO('A', 10), 1, 3, 2) X(GPIO('A', 11), 1, 4, 2) \
    X(GPIO('A', 6), 3, 1, 1) X(GPIO('A', 7), 3, 2, 1) \
    X(GPIO('B', 0), 3, 3, 1) X(GPIO('B', 1), 3, 4, 1) \
    X(GPIO('B', 4), 3, 1, 1) X(GPIO('B', 5), 3, 2, 1) \
    X(GPIO('C', 6), 3, 1, 1) X(GPIO('C', 7), 3, 2, 1) \
    X(GPIO('C', 8), 3, 3, 1) X(GPIO('C', 9), 3, 4, 1)
#endif

#elif CONFIG_MACH_STM32G4
#define TIMERS(X) X(1, 2) X(2, 1) X(3, 1) X(4, 1) X(15, 2) X(16, 2)
#define CHANNELS(X) \
    X(GPIO('A', 8), 1, 1, 6) X(GPIO('A', 9), 1, 2, 6) \
    X(GPIO('A', 10), 1, 3, 6) X(GPIO('A', 11), 1, 4, 11) \
    X(GPIO('A', 0), 2, 1, 1) X(GPIO('A', 1), 2, 2, 1) \
    X(GPIO('A', 2), 2, 3, 1) X(GPIO('A', 3), 2, 4, 1) \
    X(GPIO('A', 5), 2, 1, 1) X(GPIO('A', 15), 2, 1, 1) \
    X(GPIO('B', 3), 2, 2, 1) X(GPIO('B', 10), 2, 3, 1) \
    X(GPIO('B', 11), 2, 4, 1) \
    X(GPIO('A', 6), 3, 1, 2) X(GPIO('A', 7), 3, 2, 2) \
    X(GPIO('B', 0), 3, 3, 2) X(GPIO('B', 1), 3, 4, 2) \
    X(GPIO('B', 4), 3, 1, 2) X(GPIO('B', 5), 3, 2, 2) \
    X(GPIO('C', 6), 3, 1, 2) X(GPIO('C', 7), 3, 2, 2) \
    X(GPIO('C', 8), 3, 3, 2) X(GPIO('C', 9), 3, 4, 2) \
    X(GPIO('B', 6), 4, 1, 2) X(GPIO('B', 7), 4, 2, 2) \
    X(GPIO('B', 8), 4, 3, 2) X(GPIO('B', 9), 4, 4, 2) \
    X(GPIO('B', 14), 15, 1, 1) X(GPIO('B', 15), 15, 2, 1) \
    X(GPIO('A', 12), 16, 1, 1)

#elif CONFIG_MACH_STM32L4
#define TIMERS(X) X(1, 2) X(2, 1) X(15, 2) X(16, 2)
#define CHANNELS(X) \
    X(GPIO('A', 8), 1, 1, 1) X(GPIO('A', 9), 1, 2, 1) \
    X(GPIO('A', 10), 1, 3, 1) X(GPIO('A', 11), 1, 4, 1) \
    X(GPIO('A', 0), 2, 1, 1) X(GPIO('A', 1), 2, 2, 1) \
    X(GPIO('A', 2), 2, 3, 1) X(GPIO('A', 3), 2, 4, 1) \
    X(GPIO('A', 5), 2, 1, 1) X(GPIO('A', 15), 2, 1, 1) \
    X(GPIO('B', 3), 2, 2, 1) X(GPIO('B', 10), 2, 3, 1) \
    X(GPIO('B', 11), 2, 4, 1) \
    X(GPIO('A', 6), 16, 1, 14) X(GPIO('B', 8), 16, 1, 14) \
    X(GPIO('B', 14), 15, 1, 14) X(GPIO('B', 15), 15, 2, 14)

#elif CONFIG_MACH_STM32H7
#define TIMERS(X) \
    X(1, 1) X(2, 1) X(3, 1) X(4, 1) X(5, 1) X(12, 1) X(13, 1) X(14, 1) \
    X(15, 1) X(16, 1) X(17, 1)
#define CHANNELS(X) \
    X(GPIO('A', 8), 1, 1, 1) X(GPIO('A', 9), 1, 2, 1) \
    X(GPIO('A', 10), 1, 3, 1) X(GPIO('A', 11), 1, 4, 1) \
    X(GPIO('E', 9), 1, 1, 1) X(GPIO('E', 11), 1, 2, 1) \
    X(GPIO('E', 13), 1, 3, 1) X(GPIO('E', 14), 1, 4, 1) \
    X(GPIO('A', 5), 2, 1, 1) X(GPIO('A', 15), 2, 1, 1) \
    X(GPIO('B', 3), 2, 2, 1) X(GPIO('B', 10), 2, 3, 1) \
    X(GPIO('B', 11), 2, 4, 1) \
    X(GPIO('A', 6), 3, 1, 2) X(GPIO('A', 7), 3, 2, 2) \
    X(GPIO('B', 0), 3, 3, 2) X(GPIO('B', 1), 3, 4, 2) \
    X(GPIO('B', 4), 3, 1, 2) X(GPIO('B', 5), 3, 2, 2) \
    X(GPIO('C', 6), 3, 1, 2) X(GPIO('C', 7), 3, 2, 2) \
    X(GPIO('C', 8), 3, 3, 2) X(GPIO('C', 9), 3, 4, 2) \
    X(GPIO('B', 6), 4, 1, 2) X(GPIO('B', 7), 4, 2, 2) \
    X(GPIO('B', 8), 4, 3, 2) X(GPIO('B', 9), 4, 4, 2) \
    X(GPIO('D', 12), 4, 1, 2) X(GPIO('D', 13), 4, 2, 2) \
    X(GPIO('D', 14), 4, 3, 2) X(GPIO('D', 15), 4, 4, 2) \
    X(GPIO('A', 0), 5, 1, 2) X(GPIO('A', 1), 5, 2, 2) \
    X(GPIO('A', 2), 5, 3, 2) X(GPIO('A', 3), 5, 4, 2) \
    X(GPIO('B', 14), 12, 1, 2) X(GPIO('B', 15), 12, 2, 2) \
    X(GPIO('F', 8), 13, 1, 9) X(GPIO('F', 9), 14, 1, 9) \
    X(GPIO('E', 5), 15, 1, 4) X(GPIO('E', 6), 15, 2, 4) \
    X(GPIO('F', 6), 16, 1, 1) X(GPIO('F', 7), 17, 1, 1)
#endif

/* Timers of bus 1 count at half the clock where its divider is 4 (H7: all). */
#if CONFIG_STM32_F2F4F7 && !CONFIG_MACH_STM32F401 || CONFIG_MACH_STM32H7
#define BUS1_TIMER_DIVIDER 2
#else
#define BUS1_TIMER_DIVIDER 1
#endif
