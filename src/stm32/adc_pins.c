/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which channel of which converter a pin has: data sheets, table of pins. */
#include "adc_pins.h"
#include "chip.h"

/* Pins in order of their channels, from channel `first` on */
struct span {
    uint8_t unit, first, n_pins;
    const uint8_t *pins;
};
#define SPAN(UNIT, FIRST, PINS) { UNIT, FIRST, sizeof(PINS), PINS }

#if CONFIG_STM32_ADC_V1 || CONFIG_MACH_STM32F0
static const uint8_t unit1_pins[] = {
    GPIO('A', 0), GPIO('A', 1), GPIO('A', 2), GPIO('A', 3), GPIO('A', 4),
    GPIO('A', 5), GPIO('A', 6), GPIO('A', 7), GPIO('B', 0), GPIO('B', 1),
    GPIO('C', 0), GPIO('C', 1), GPIO('C', 2), GPIO('C', 3), GPIO('C', 4),
    GPIO('C', 5),
};
#endif
#if CONFIG_MACH_STM32F2 || CONFIG_STM32_ADC_V1 && CONFIG_STM32_F2F4F7 \
    && !CONFIG_MACH_STM32F401
#define HAS_ADC3 1
static const uint8_t unit3_pins[] = {
    GPIO('F', 6), GPIO('F', 7), GPIO('F', 8), GPIO('F', 9), GPIO('F', 10),
    GPIO('F', 3),
};
static const uint8_t unit3_more[] = { GPIO('F', 4), GPIO('F', 5) };
#endif

#if CONFIG_MACH_STM32G0
static const uint8_t g0_pins[] = {
    GPIO('A', 0), GPIO('A', 1), GPIO('A', 2), GPIO('A', 3), GPIO('A', 4),
    GPIO('A', 5), GPIO('A', 6), GPIO('A', 7), GPIO('B', 0), GPIO('B', 1),
    GPIO('B', 2), GPIO('B', 10),
};
static const uint8_t g0_more[] = {
    GPIO('B', 11), GPIO('B', 12), GPIO('C', 4), GPIO('C', 5),
};
#define CHANNEL_TEMPERATURE 12
#endif

#if CONFIG_MACH_STM32G4
static const uint8_t g4_first[] = {
    GPIO('A', 0), GPIO('A', 1), GPIO('A', 2), GPIO('A', 3), GPIO('B', 14),
    GPIO('C', 0), GPIO('C', 1), GPIO('C', 2), GPIO('C', 3), GPIO('F', 0),
    GPIO('B', 12), GPIO('B', 1), GPIO_NONE, GPIO_NONE, GPIO('B', 0),
};
static const uint8_t g4_second[] = {
    GPIO('A', 6), GPIO('A', 7), GPIO('C', 4), GPIO_NONE, GPIO_NONE, GPIO_NONE,
    GPIO_NONE, GPIO('F', 1), GPIO('C', 5), GPIO('B', 2), GPIO('A', 5),
    GPIO('B', 11), GPIO('B', 15), GPIO_NONE, GPIO('A', 4),
};
#define CHANNEL_TEMPERATURE 16
#elif CONFIG_MACH_STM32L4
static const uint8_t l4_pins[] = {
    GPIO('C', 0), GPIO('C', 1), GPIO('C', 2), GPIO('C', 3), GPIO('A', 0),
    GPIO('A', 1), GPIO('A', 2), GPIO('A', 3), GPIO('A', 4), GPIO('A', 5),
    GPIO('A', 6), GPIO('A', 7), GPIO('C', 4), GPIO('C', 5), GPIO('B', 0),
    GPIO('B', 1),
};
#define CHANNEL_TEMPERATURE 17
#elif CONFIG_MACH_STM32H7
static const uint8_t h7_pins[] = {
    GPIO('F', 11), GPIO('A', 6), GPIO('C', 4), GPIO('B', 1), GPIO('F', 12),
    GPIO('A', 7), GPIO('C', 5), GPIO('B', 0), GPIO('C', 0), GPIO('C', 1),
    GPIO('C', 2), GPIO('C', 3), GPIO('A', 2), GPIO('A', 3), GPIO('A', 0),
    GPIO('A', 1), GPIO('A', 4), GPIO('A', 5),
};
static const uint8_t h7_third[] = {
    GPIO('F', 9), GPIO('F', 7), GPIO('F', 5), GPIO('F', 3), GPIO('F', 10),
    GPIO('F', 8), GPIO('F', 6), GPIO('F', 4),
};
#define TEMPERATURE_UNIT 1
#define CHANNEL_TEMPERATURE (CONFIG_MACH_STM32H723 ? 17 : 18)
#endif

#ifndef TEMPERATURE_UNIT
#define TEMPERATURE_UNIT 0
#endif
#if CONFIG_MACH_STM32F1 || CONFIG_MACH_STM32F2 || CONFIG_MACH_STM32F405 \
    || CONFIG_MACH_STM32F407 || CONFIG_MACH_STM32F0
#define CHANNEL_TEMPERATURE 16
#elif CONFIG_STM32_ADC_V1
#define CHANNEL_TEMPERATURE 18
#endif
static const uint8_t temperature[] = { PIN_ADC_TEMPERATURE };

static const struct span spans[] = {
    SPAN(TEMPERATURE_UNIT, CHANNEL_TEMPERATURE, temperature),
#if CONFIG_STM32_ADC_V1 || CONFIG_MACH_STM32F0
    SPAN(0, 0, unit1_pins),
#endif
#if CONFIG_MACH_STM32G4
    SPAN(0, 1, g4_first),
    SPAN(1, 3, g4_second),
#endif
#if CONFIG_MACH_STM32L4
    SPAN(0, 1, l4_pins),
#endif
#if CONFIG_MACH_STM32H7
    SPAN(0, 2, h7_pins),
    SPAN(1, 2, h7_third),
#endif
#if CONFIG_MACH_STM32G0
    SPAN(0, 0, g0_pins),
    SPAN(0, 15, g0_more),
#endif
#if HAS_ADC3
    SPAN(1, 4, unit3_pins),
    SPAN(1, 14, unit3_more),
#endif
};

struct gpio_adc adc_find(uint32_t pin)
{
    const struct span *span = spans;

    for (; span < spans + sizeof(spans) / sizeof(spans[0]); span++) {
        uint8_t i;

        for (i = 0; i < span->n_pins; i++)
            if (span->pins[i] == pin && pin != GPIO_NONE)
                return (struct gpio_adc) { (uint8_t)(span->first + i),
                                           span->unit };
    }
    return (struct gpio_adc) { ADC_NO_CHANNEL, 0 };
}
