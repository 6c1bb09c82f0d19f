/* SPDX-License-Identifier: GPL-3.0-or-later
 * The converter (UM10360, chapter 29).  It is known for single readings that
 * are far off, so a value is the median of three. */
#include "board/adc.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"

DECL_CONSTANT("ADC_MAX", 4095);

#define REGS ((struct adc_regs *)ADC_BASE)
/* At most 13 MHz; 65 of those clocks a conversion */
#define DIVIDER ((CONFIG_CLOCK_FREQ + 12999999u) / 13000000u)
#define CONVERSION_TICKS (DIVIDER * 68)
#define N_SAMPLES 3
#define IDLE 0xff

static const struct {
    uint8_t pin, function;
} channels[] = {
    { GPIO(0, 23), 1 }, { GPIO(0, 24), 1 }, { GPIO(0, 25), 1 },
    { GPIO(0, 26), 1 }, { GPIO(1, 30), 3 }, { GPIO(1, 31), 3 },
    { GPIO(0, 3), 2 }, { GPIO(0, 2), 2 },
};
#define N_CHANNELS (sizeof(channels) / sizeof(channels[0]))

/* Channel that converts or waits to be read, and its values so far. */
static uint8_t owner = IDLE, n_values;
static uint16_t values[N_SAMPLES];

struct gpio_adc adc_setup(uint32_t pin)
{
    uint8_t channel = 0;

    while (channel < N_CHANNELS && channels[channel].pin != pin)
        channel++;
    if (channel == N_CHANNELS)
        shutdown("Not a valid ADC pin");
    chip_enable(ADC_POWER);
    if (owner == IDLE)
        REGS->CR = ADC_CR_PDN | ADC_CR_CLKDIV(DIVIDER);
    gpio_alternate(pin, channels[channel].function, 0);
    return (struct gpio_adc) { channel };
}

static void start_conversion(uint8_t channel)
{
    REGS->CR = 1u << channel | ADC_CR_PDN | ADC_CR_CLKDIV(DIVIDER)
        | ADC_CR_START;
}

uint32_t adc_sample(struct gpio_adc adc)
{
    uint32_t value;

    if (owner != adc.channel) {
        if (owner != IDLE)
            return CONVERSION_TICKS * N_SAMPLES;
        owner = adc.channel;
        n_values = 0;
        (void)REGS->DR[adc.channel]; /* what was cancelled is no news */
        start_conversion(adc.channel);
        return CONVERSION_TICKS;
    }
    if (n_values == N_SAMPLES)
        return 0;
    value = REGS->DR[adc.channel];
    if (!(value & ADC_DR_DONE))
        return CONVERSION_TICKS / 4;
    values[n_values++] = value >> 4 & 0xfff;
    if (n_values == N_SAMPLES)
        return 0;
    start_conversion(adc.channel);
    return CONVERSION_TICKS;
}

uint16_t adc_read(struct gpio_adc adc)
{
    uint16_t low = values[0], high = values[1];

    (void)adc;
    owner = IDLE;
    if (low > high) {
        low = values[1];
        high = values[0];
    }
    return values[2] < low ? low : values[2] > high ? high : values[2];
}

/* What still converts is overtaken by the next start. */
void adc_cancel(struct gpio_adc adc)
{
    irq_flag_t flag = irq_save();

    if (owner == adc.channel)
        owner = IDLE;
    irq_restore(flag);
}
