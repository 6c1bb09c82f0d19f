/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins of the converters in order of their channels: DS40001882, table 7-1;
 * DS60001479, table 6-1; DS60001507, table 6-1.  Included once, by adc.c.
 */
static const uint8_t unit0_pins[] = {
    GPIO('A', 2), GPIO('A', 3), GPIO('B', 8), GPIO('B', 9), GPIO('A', 4),
    GPIO('A', 5), GPIO('A', 6), GPIO('A', 7),
#if CONFIG_MACH_SAMD21
    GPIO('B', 0), GPIO('B', 1), GPIO('B', 2), GPIO('B', 3), GPIO('B', 4),
    GPIO('B', 5), GPIO('B', 6), GPIO('B', 7), GPIO('A', 8), GPIO('A', 9),
    GPIO('A', 10), GPIO('A', 11),
#else
    GPIO('A', 8), GPIO('A', 9), GPIO('A', 10), GPIO('A', 11),
#endif
#if CONFIG_MACH_SAMX5
    GPIO('B', 0), GPIO('B', 1), GPIO('B', 2), GPIO('B', 3),
#endif
};
#if CONFIG_MACH_SAMX5
static const uint8_t unit1_pins[] = {
    GPIO('B', 8), GPIO('B', 9), GPIO('A', 8), GPIO('A', 9), GPIO('C', 2),
    GPIO('C', 3), GPIO('B', 4), GPIO('B', 5), GPIO('B', 6), GPIO('B', 7),
    GPIO('C', 0), GPIO('C', 1), GPIO('C', 30), GPIO('C', 31), GPIO('D', 0),
    GPIO('D', 1),
};
#endif
