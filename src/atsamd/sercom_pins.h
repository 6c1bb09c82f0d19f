/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins of SERCOM units: DS40001882, table 7-1 (that of DS60001479 has the
 * same); DS60001507, table 6-1.  Included once, by sercom.c.
 *
 * SERCOM_PINS(X): X(port, bit, unit, pad, function)
 */
#if CONFIG_MACH_SAMX5
#define SERCOM_PINS(X) \
    X('A', 4, 0, 0, MUX_D) X('A', 5, 0, 1, MUX_D) X('A', 6, 0, 2, MUX_D) \
    X('A', 7, 0, 3, MUX_D) X('A', 8, 0, 0, MUX_C) X('A', 9, 0, 1, MUX_C) \
    X('A', 10, 0, 2, MUX_C) X('A', 11, 0, 3, MUX_C) X('B', 24, 0, 0, MUX_C) \
    X('B', 25, 0, 1, MUX_C) X('C', 24, 0, 2, MUX_C) X('C', 25, 0, 3, MUX_C) \
    X('C', 17, 0, 0, MUX_D) X('C', 16, 0, 1, MUX_D) X('C', 18, 0, 2, MUX_D) \
    X('C', 19, 0, 3, MUX_D) \
    X('A', 0, 1, 0, MUX_D) X('A', 1, 1, 1, MUX_D) X('A', 16, 1, 0, MUX_C) \
    X('A', 17, 1, 1, MUX_C) X('A', 18, 1, 2, MUX_C) X('A', 19, 1, 3, MUX_C) \
    X('A', 30, 1, 2, MUX_D) X('A', 31, 1, 3, MUX_D) X('B', 22, 1, 2, MUX_C) \
    X('B', 23, 1, 3, MUX_C) X('C', 22, 1, 0, MUX_C) X('C', 23, 1, 1, MUX_C) \
    X('C', 27, 1, 0, MUX_C) X('C', 28, 1, 1, MUX_C) X('D', 20, 1, 2, MUX_C) \
    X('D', 21, 1, 3, MUX_C) \
    X('A', 9, 2, 0, MUX_D) X('A', 8, 2, 1, MUX_D) X('A', 10, 2, 2, MUX_D) \
    X('A', 11, 2, 3, MUX_D) X('A', 12, 2, 0, MUX_C) X('A', 13, 2, 1, MUX_C) \
    X('A', 14, 2, 2, MUX_C) X('A', 15, 2, 3, MUX_C) X('B', 25, 2, 0, MUX_D) \
    X('B', 24, 2, 1, MUX_D) X('B', 26, 2, 0, MUX_C) X('B', 27, 2, 1, MUX_C) \
    X('B', 28, 2, 2, MUX_C) X('B', 29, 2, 3, MUX_C) X('C', 24, 2, 2, MUX_D) \
    X('C', 25, 2, 3, MUX_D) \
    X('A', 17, 3, 0, MUX_D) X('A', 16, 3, 1, MUX_D) X('A', 18, 3, 2, MUX_D) \
    X('A', 19, 3, 3, MUX_D) X('A', 20, 3, 2, MUX_D) X('A', 21, 3, 3, MUX_D) \
    X('A', 22, 3, 0, MUX_C) X('A', 23, 3, 1, MUX_C) X('A', 24, 3, 2, MUX_C) \
    X('A', 25, 3, 3, MUX_C) X('B', 20, 3, 0, MUX_C) X('B', 21, 3, 1, MUX_C) \
    X('C', 23, 3, 0, MUX_D) X('C', 22, 3, 1, MUX_D) X('D', 20, 3, 2, MUX_D) \
    X('D', 21, 3, 3, MUX_D) \
    X('A', 13, 4, 0, MUX_D) X('A', 12, 4, 1, MUX_D) X('A', 14, 4, 2, MUX_D) \
    X('A', 15, 4, 3, MUX_D) X('B', 8, 4, 0, MUX_D) X('B', 9, 4, 1, MUX_D) \
    X('B', 10, 4, 2, MUX_D) X('B', 11, 4, 3, MUX_D) X('B', 12, 4, 0, MUX_C) \
    X('B', 13, 4, 1, MUX_C) X('B', 14, 4, 2, MUX_C) X('B', 15, 4, 3, MUX_C) \
    X('B', 27, 4, 0, MUX_D) X('B', 26, 4, 1, MUX_D) X('B', 28, 4, 2, MUX_D) \
    X('B', 29, 4, 3, MUX_D) \
    X('A', 20, 5, 2, MUX_C) X('A', 21, 5, 3, MUX_C) X('A', 23, 5, 0, MUX_D) \
    X('A', 22, 5, 1, MUX_D) X('A', 24, 5, 2, MUX_D) X('A', 25, 5, 3, MUX_D) \
    X('B', 0, 5, 2, MUX_D) X('B', 1, 5, 3, MUX_D) X('B', 2, 5, 0, MUX_D) \
    X('B', 3, 5, 1, MUX_D) X('B', 16, 5, 0, MUX_C) X('B', 17, 5, 1, MUX_C) \
    X('B', 18, 5, 2, MUX_C) X('B', 19, 5, 3, MUX_C) X('B', 22, 5, 2, MUX_D) \
    X('B', 23, 5, 3, MUX_D) X('B', 31, 5, 0, MUX_D) X('B', 30, 5, 1, MUX_D) \
    X('C', 4, 6, 0, MUX_C) X('C', 5, 6, 1, MUX_C) X('C', 6, 6, 2, MUX_C) \
    X('C', 7, 6, 3, MUX_C) X('C', 10, 6, 2, MUX_C) X('C', 11, 6, 3, MUX_C) \
    X('C', 13, 6, 0, MUX_D) X('C', 12, 6, 1, MUX_D) X('C', 14, 6, 2, MUX_D) \
    X('C', 15, 6, 3, MUX_D) X('C', 16, 6, 0, MUX_C) X('C', 17, 6, 1, MUX_C) \
    X('C', 18, 6, 2, MUX_C) X('C', 19, 6, 3, MUX_C) X('D', 9, 6, 0, MUX_D) \
    X('D', 8, 6, 1, MUX_D) X('D', 10, 6, 2, MUX_D) X('D', 11, 6, 3, MUX_D) \
    X('A', 30, 7, 2, MUX_C) X('A', 31, 7, 3, MUX_C) X('B', 18, 7, 2, MUX_D) \
    X('B', 19, 7, 3, MUX_D) X('B', 21, 7, 0, MUX_D) X('B', 20, 7, 1, MUX_D) \
    X('B', 30, 7, 0, MUX_C) X('B', 31, 7, 1, MUX_C) X('C', 10, 7, 2, MUX_D) \
    X('C', 11, 7, 3, MUX_D) X('C', 12, 7, 0, MUX_C) X('C', 13, 7, 1, MUX_C) \
    X('C', 14, 7, 2, MUX_C) X('C', 15, 7, 3, MUX_C) X('D', 8, 7, 0, MUX_C) \
    X('D', 9, 7, 1, MUX_C) X('D', 10, 7, 2, MUX_C) X('D', 11, 7, 3, MUX_C)
#else
#define SERCOM_PINS(X) \
    X('A', 4, 0, 0, MUX_D) X('A', 5, 0, 1, MUX_D) X('A', 6, 0, 2, MUX_D) \
    X('A', 7, 0, 3, MUX_D) X('A', 8, 0, 0, MUX_C) X('A', 9, 0, 1, MUX_C) \
    X('A', 10, 0, 2, MUX_C) X('A', 11, 0, 3, MUX_C) \
    X('A', 0, 1, 0, MUX_D) X('A', 1, 1, 1, MUX_D) X('A', 16, 1, 0, MUX_C) \
    X('A', 17, 1, 1, MUX_C) X('A', 18, 1, 2, MUX_C) X('A', 19, 1, 3, MUX_C) \
    X('A', 30, 1, 2, MUX_D) X('A', 31, 1, 3, MUX_D) \
    X('A', 8, 2, 0, MUX_D) X('A', 9, 2, 1, MUX_D) X('A', 10, 2, 2, MUX_D) \
    X('A', 11, 2, 3, MUX_D) X('A', 12, 2, 0, MUX_C) X('A', 13, 2, 1, MUX_C) \
    X('A', 14, 2, 2, MUX_C) X('A', 15, 2, 3, MUX_C) \
    X('A', 16, 3, 0, MUX_D) X('A', 17, 3, 1, MUX_D) X('A', 18, 3, 2, MUX_D) \
    X('A', 19, 3, 3, MUX_D) X('A', 20, 3, 2, MUX_D) X('A', 21, 3, 3, MUX_D) \
    X('A', 22, 3, 0, MUX_C) X('A', 23, 3, 1, MUX_C) X('A', 24, 3, 2, MUX_C) \
    X('A', 25, 3, 3, MUX_C) \
    X('A', 12, 4, 0, MUX_D) X('A', 13, 4, 1, MUX_D) X('A', 14, 4, 2, MUX_D) \
    X('A', 15, 4, 3, MUX_D) X('B', 8, 4, 0, MUX_D) X('B', 9, 4, 1, MUX_D) \
    X('B', 10, 4, 2, MUX_D) X('B', 11, 4, 3, MUX_D) X('B', 12, 4, 0, MUX_C) \
    X('B', 13, 4, 1, MUX_C) X('B', 14, 4, 2, MUX_C) X('B', 15, 4, 3, MUX_C) \
    X('A', 20, 5, 2, MUX_C) X('A', 21, 5, 3, MUX_C) X('A', 22, 5, 0, MUX_D) \
    X('A', 23, 5, 1, MUX_D) X('A', 24, 5, 2, MUX_D) X('A', 25, 5, 3, MUX_D) \
    X('B', 0, 5, 2, MUX_D) X('B', 1, 5, 3, MUX_D) X('B', 2, 5, 0, MUX_D) \
    X('B', 3, 5, 1, MUX_D) X('B', 16, 5, 0, MUX_C) X('B', 17, 5, 1, MUX_C) \
    X('B', 22, 5, 2, MUX_D) X('B', 23, 5, 3, MUX_D) X('B', 30, 5, 0, MUX_D) \
    X('B', 31, 5, 1, MUX_D)
#endif
