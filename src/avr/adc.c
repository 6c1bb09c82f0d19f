/* SPDX-License-Identifier: GPL-3.0-or-later
 * The analog to digital converter. */
#include "board/adc.h"
#include "core/sched.h"

#define ADC_MAX 1023
#define NO_PIN 0xfe
#define IDLE 0xff
/* 13 cycles of the converter's clock, and one to start */
#define CONVERSION_TICKS (14 * 128)

DECL_CONSTANT("ADC_MAX", ADC_MAX);

/* The pin of each channel. */
static const ROM uint8_t pins[] = {
#if CONFIG_AVR_MEGA
    PIN_NUMBER('F', 0), PIN_NUMBER('F', 1), PIN_NUMBER('F', 2),
    PIN_NUMBER('F', 3), PIN_NUMBER('F', 4), PIN_NUMBER('F', 5),
    PIN_NUMBER('F', 6), PIN_NUMBER('F', 7),
    PIN_NUMBER('K', 0), PIN_NUMBER('K', 1), PIN_NUMBER('K', 2),
    PIN_NUMBER('K', 3), PIN_NUMBER('K', 4), PIN_NUMBER('K', 5),
    PIN_NUMBER('K', 6), PIN_NUMBER('K', 7),
#elif CONFIG_AVR_AT90USB
    PIN_NUMBER('F', 0), PIN_NUMBER('F', 1), PIN_NUMBER('F', 2),
    PIN_NUMBER('F', 3), PIN_NUMBER('F', 4), PIN_NUMBER('F', 5),
    PIN_NUMBER('F', 6), PIN_NUMBER('F', 7),
#elif CONFIG_AVR_U4
    PIN_NUMBER('F', 0), PIN_NUMBER('F', 1), NO_PIN, NO_PIN,
    PIN_NUMBER('F', 4), PIN_NUMBER('F', 5), PIN_NUMBER('F', 6),
    PIN_NUMBER('F', 7),
    PIN_NUMBER('D', 4), PIN_NUMBER('D', 6), PIN_NUMBER('D', 7),
    PIN_NUMBER('B', 4), PIN_NUMBER('B', 5), PIN_NUMBER('B', 6),
#elif CONFIG_AVR_X4
    PIN_NUMBER('A', 0), PIN_NUMBER('A', 1), PIN_NUMBER('A', 2),
    PIN_NUMBER('A', 3), PIN_NUMBER('A', 4), PIN_NUMBER('A', 5),
    PIN_NUMBER('A', 6), PIN_NUMBER('A', 7),
#else
    PIN_NUMBER('C', 0), PIN_NUMBER('C', 1), PIN_NUMBER('C', 2),
    PIN_NUMBER('C', 3), PIN_NUMBER('C', 4), PIN_NUMBER('C', 5),
    PIN_NUMBER('E', 2), PIN_NUMBER('E', 3),
#endif
};

#if CONFIG_AVR_X8
/* The channels 6 and 7 have pins of their own on chips with 32 legs. */
DECL_ENUMERATION_RANGE("pin", "PE2", PIN_NUMBER('E', 2), 2);
#endif

/* Channel that converts or waits to be read. */
static uint8_t owner = IDLE;

struct gpio_adc adc_setup(uint32_t pin)
{
    uint8_t channel = IDLE, i;

    for (i = 0; i < sizeof(pins); i++)
        if (pins[i] == pin)
            channel = i;
    if (channel == IDLE)
        shutdown("Not a valid ADC pin");
    ADCSRA = (1 << ADEN) | (1 << ADPS2) | (1 << ADPS1) | (1 << ADPS0);
    return (struct gpio_adc) { channel };
}

uint32_t adc_sample(struct gpio_adc adc)
{
    if (owner == adc.channel)
        return ADCSRA & (1 << ADSC) ? CONVERSION_TICKS / 4 : 0;
    if (owner != IDLE)
        return CONVERSION_TICKS;
    owner = adc.channel;
    ADMUX = (uint8_t)((1 << REFS0) | (adc.channel & 7));
#ifdef MUX5
    ADCSRB = adc.channel & 8 ? 1 << MUX5 : 0;
#endif
    ADCSRA |= 1 << ADSC;
    return CONVERSION_TICKS;
}

uint16_t adc_read(struct gpio_adc adc)
{
    (void)adc;
    owner = IDLE;
    return ADC;
}

void adc_cancel(struct gpio_adc adc)
{
    if (owner != adc.channel)
        return;
    ADCSRA &= (uint8_t)~(1 << ADEN);
    ADCSRA |= 1 << ADEN;
    owner = IDLE;
}
