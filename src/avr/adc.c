/* SPDX-License-Identifier: GPL-3.0-or-later
 * The analog to digital converter. */
#include "board/adc.h"
#include "core/sched.h"

#define ADC_MAX 1023
#define IDLE 0xff
/* 13 cycles of the converter's clock, and one to start */
#define CONVERSION_TICKS (14 * 128)

DECL_CONSTANT("ADC_MAX", ADC_MAX);

/* Channel that converts or waits to be read. */
static uint8_t owner = IDLE;

struct gpio_adc adc_setup(uint32_t pin)
{
    uint8_t channel = IDLE;

#if CONFIG_MACH_atmega2560
    if (pin >= 40 && pin < 48)
        channel = (uint8_t)(pin - 40);
    else if (pin >= 80 && pin < 88)
        channel = (uint8_t)(pin - 80 + 8);
#else
    if (pin < 8)
        channel = (uint8_t)pin;
#endif
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
#if CONFIG_MACH_atmega2560
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
