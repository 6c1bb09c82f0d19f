/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins of the converters in order of their channels, and where the temperature
 * of the chip is.  Included once, by adc.c.
 */
#if CONFIG_MACH_SAM3X
static const uint8_t unit0_pins[] = {
    GPIO('A', 2), GPIO('A', 3), GPIO('A', 4), GPIO('A', 6), GPIO('A', 22),
    GPIO('A', 23), GPIO('A', 24), GPIO('A', 16), GPIO('B', 12), GPIO('B', 13),
    GPIO('B', 17), GPIO('B', 18), GPIO('B', 19), GPIO('B', 20), GPIO('B', 21),
    PIN_ADC_TEMPERATURE,
};
#elif CONFIG_MACH_SAM4S
static const uint8_t unit0_pins[] = {
    GPIO('A', 17), GPIO('A', 18), GPIO('A', 19), GPIO('A', 20), GPIO('B', 0),
    GPIO('B', 1), GPIO('B', 2), GPIO('B', 3), GPIO('A', 21), GPIO('A', 22),
    GPIO('C', 13), GPIO('C', 15), GPIO('C', 12), GPIO('C', 29), GPIO('C', 30),
    PIN_ADC_TEMPERATURE,
};
#elif CONFIG_MACH_SAM4E
static const uint8_t unit0_pins[] = {
    GPIO('A', 17), GPIO('A', 18), GPIO('A', 19), GPIO('A', 20), GPIO('B', 0),
    GPIO('B', 1), GPIO('C', 13), GPIO('C', 15), GPIO('C', 12), GPIO('C', 29),
    GPIO('C', 30), GPIO('C', 31), GPIO('C', 26), GPIO('C', 27), GPIO('C', 0),
    PIN_ADC_TEMPERATURE,
};
static const uint8_t unit1_pins[] = {
    GPIO('B', 2), GPIO('B', 3), GPIO('A', 21), GPIO('A', 22), GPIO('C', 1),
    GPIO('C', 2), GPIO('C', 3), GPIO('C', 4),
};
#elif CONFIG_MACH_SAME70
static const uint8_t unit0_pins[] = {
    GPIO('D', 30), GPIO('A', 21), GPIO('B', 3), GPIO('E', 5), GPIO('E', 4),
    GPIO('B', 2), GPIO('A', 17), GPIO('A', 18), GPIO('A', 19), GPIO('A', 20),
    GPIO('B', 0), PIN_ADC_TEMPERATURE,
};
static const uint8_t unit1_pins[] = {
    GPIO('B', 1), GPIO('C', 13), GPIO('C', 15), GPIO('C', 12), GPIO('C', 29),
    GPIO('C', 30), GPIO('C', 31), GPIO('C', 26), GPIO('C', 27), GPIO('C', 0),
    GPIO('E', 3), GPIO('E', 0),
};
#endif
