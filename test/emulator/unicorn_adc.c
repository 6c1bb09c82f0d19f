/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Converters of an STM32.
 */
#include "unicorn_chip.h"

/*
 * ADC of the F1, F2, F4 and F7
 */

enum { ADC2_ISR = 0, ADC2_CR = 2, ADC2_CFGR2 = 4, ADC2_SMPR = 5,
       ADC2_CHSELR = 10, ADC2_DR = 16 };
enum { ADC2_ADRDY = 1, ADC2_EOC = 4, ADC2_CCRDY = 1 << 13, ADC2_ADEN = 1,
       ADC2_ADSTART = 4, ADC2_ADSTP = 16 };
enum { ADC_SR = 0, ADC_CR2 = 2, ADC_SQR3 = 13, ADC_DR = 19 };

static void
adc_start(struct device *d)
{
    static const uint16_t f1[] = { 1, 7, 13, 28, 41, 55, 71, 239 };
    static const uint16_t f4[] = { 3, 15, 28, 56, 84, 112, 144, 480 };
    bool is_f1 = chip.model->line == LINE_F1;
    uint32_t channel = d->regs[ADC_SQR3] & 31;
    uint32_t smpr = d->regs[channel >= 10 ? 3 : 4];
    uint32_t sample = (smpr >> (3 * (channel % 10))) & 7, divider;

    divider = is_f1 ? 2 * ((chip.rcc->regs[1] >> 14) & 3) + 2 : 4;
    if (chip.bus_hz[2] / divider > (is_f1 ? 14000000u : 36000000u))
        chip_fault("converter at %u Hz", chip.bus_hz[2] / divider);
    d->due = chip.cycle + ((is_f1 ? f1 : f4)[sample] + 13u) * divider
        * (chip.core_hz / chip.bus_hz[2]);
    d->shift = channel;
    chip_wake_at(d->due);
}

void
adc_run_event(struct device *d)
{
    int pin = chip.model->adc_pin(d->info->index, (uint8_t)d->shift);
    uint32_t value;

    if (chip.cycle < d->due)
        return;
    d->due = NEVER;
    value = pin < 0 ? 0
        : chip.host.adc_in(chip.host.ctx, chip_now(), (uint32_t)pin);
    /* 12 bits, of an H7 16 */
    if (chip.model->line != LINE_H7)
        value >>= 4;
    if (chip.model->adc_version == 1) {
        d->regs[ADC_SR] |= 2;
        d->regs[ADC_DR] = value;
    } else {
        d->regs[ADC2_CR] &= ~(uint32_t)ADC2_ADSTART;
        d->regs[ADC2_ISR] |= ADC2_EOC;
        d->regs[ADC2_DR] = value;
    }
}

static void
adc1_write(struct device *d, uint32_t word, uint32_t value)
{
    bool is_f1 = chip.model->line == LINE_F1;

    if (word == ADC_SR) {
        d->regs[ADC_SR] &= value;
        return;
    }
    if (word == ADC_CR2) {
        bool was_on = d->regs[ADC_CR2] & 1;

        /* calibration ends at once, a start is no state */
        d->regs[ADC_CR2] = value & ~(is_f1 ? 1u << 2 | 1u << 22 : 1u << 30);
        if (was_on && value & (is_f1 ? 1u << 22 : 1u << 30))
            adc_start(d);
        return;
    }
    d->regs[word] = value;
}

static uint32_t
adc1_read(struct device *d, uint32_t word)
{
    if (word == ADC_DR)
        d->regs[ADC_SR] &= ~2u;
    return d->regs[word];
}

/*
 * ADC of the F0 and G0
 */

static void
adc2_start(struct device *d)
{
    static const uint16_t f0[] = { 1, 7, 13, 28, 41, 55, 71, 239 };
    static const uint16_t g0[] = { 1, 3, 7, 12, 19, 39, 79, 160 };
    bool is_f0 = chip.model->line == LINE_F0;
    uint32_t sample = (is_f0 ? f0 : g0)[d->regs[ADC2_SMPR] & 7];
    uint32_t mode = d->regs[ADC2_CFGR2] >> 30, hz = chip.bus_hz[1];
    uint32_t divider = mode == 1 ? 2 : mode == 2 ? 4 : 1;

    if (!(d->regs[ADC2_CR] & ADC2_ADEN) || !mode)
        chip_fault("converter is off, or has no clock");
    if (hz / divider > (is_f0 ? 14000000u : 35000000u))
        chip_fault("converter at %u Hz", hz / divider);
    d->shift = (uint32_t)__builtin_ctz(d->regs[ADC2_CHSELR] | 1u << 31);
    d->due = chip.cycle + (sample + 13u) * divider;
    chip_wake_at(d->due);
}

static uint32_t
adc2_read(struct device *d, uint32_t word)
{
    if (word == ADC2_DR)
        d->regs[ADC2_ISR] &= ~(uint32_t)ADC2_EOC;
    return d->regs[word];
}

static void
adc2_write(struct device *d, uint32_t word, uint32_t value)
{
    bool is_g0 = chip.model->line == LINE_G0;

    if (word == ADC2_ISR) {
        d->regs[ADC2_ISR] &= ~value;
        return;
    }
    if (word == ADC2_CHSELR)
        d->regs[ADC2_ISR] |= is_g0 ? ADC2_CCRDY : 0;
    if (word != ADC2_CR) {
        d->regs[word] = value;
        return;
    }
    if (is_g0 && value & (ADC2_ADEN | 1u << 31) && !(value & (1u << 28)))
        chip_fault("converter without its regulator");
    if (value & ADC2_ADEN)
        d->regs[ADC2_ISR] |= ADC2_ADRDY;
    if (value & ADC2_ADSTP) {
        d->due = NEVER;
        value &= ~(uint32_t)(ADC2_ADSTP | ADC2_ADSTART);
    }
    d->regs[ADC2_CR] = value & ~(1u << 31);
    if (value & ADC2_ADSTART)
        adc2_start(d);
}

/*
 * ADC of the G4, L4 and H7: ISR, CR, EOC and DR are where the F0 has them
 */

enum { ADC3_SMPR = 5, ADC3_PCSEL = 7, ADC3_SQR1 = 12 };

static void
adc3_start(struct device *d)
{
    static const uint16_t g4[] = { 2, 6, 12, 24, 47, 92, 247, 640 };
    static const uint16_t h7[] = { 1, 2, 8, 16, 32, 64, 387, 810 };
    bool is_h7 = chip.model->line == LINE_H7;
    uint32_t channel = (d->regs[ADC3_SQR1] >> 6) & 31;
    uint32_t smpr = d->regs[ADC3_SMPR + channel / 10] >> (3 * (channel % 10));

    if (!(d->regs[ADC2_CR] & ADC2_ADEN))
        chip_fault("converter is off");
    if (is_h7 && !(d->regs[ADC3_PCSEL] & (1u << channel)))
        chip_fault("channel %u is not preselected", channel);
    d->shift = channel;
    d->due = chip.cycle;
    if (is_h7)
        d->due += (h7[smpr & 7] + 9u) * (chip.core_hz / 16000000);
    else
        d->due += (g4[smpr & 7] + 13u) * 4;
    chip_wake_at(d->due);
}

static void
adc3_write(struct device *d, uint32_t word, uint32_t value)
{
    if (word == ADC2_ISR) {
        d->regs[ADC2_ISR] &= ~value;
        return;
    }
    if (word != ADC2_CR) {
        d->regs[word] = value;
        return;
    }
    if (value & (1u << 29))
        chip_fault("converter in deep sleep");
    if (value & (ADC2_ADEN | 1u << 31) && !(value & (1u << 28)))
        chip_fault("converter without its regulator");
    if (value & ADC2_ADEN)
        d->regs[ADC2_ISR] |= ADC2_ADRDY;
    if (value & ADC2_ADSTP)
        d->due = NEVER;
    value |= d->regs[ADC2_CR] & ADC2_ADEN;
    d->regs[ADC2_CR] = value & ~(1u << 31 | ADC2_ADSTP);
    if (value & ADC2_ADSTART)
        adc3_start(d);
}


/*
 * Of any version
 */

uint32_t
adc_read(struct device *d, uint32_t word)
{
    return chip.model->adc_version == 1 ? adc1_read(d, word)
        : adc2_read(d, word);
}

void
adc_write(struct device *d, uint32_t word, uint32_t value)
{
    if (chip.model->adc_version == 1)
        adc1_write(d, word, value);
    else if (chip.model->adc_version == 2)
        adc2_write(d, word, value);
    else
        adc3_write(d, word, value);
}
