/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Converter, pwm and watchdog of an LPC176x (UM10360, chapters 29, 24, 28).
 */
#include <string.h>

#include "unicorn_lpc.h"

/*
 * Converter
 */

enum { ADC_CR = 0, ADC_GDR = 4, ADC_DR = 0x10, CONVERSION_CLOCKS = 65 };
#define DONE (1u << 31)

static void
converter_write(struct device *d, uint32_t offset, uint32_t value)
{
    static const uint8_t pins[] = { 23, 24, 25, 26, 62, 63, 3, 2 };
    static const uint8_t functions[] = { 1, 1, 1, 1, 3, 3, 2, 2 };
    uint32_t divider = (value >> 8 & 255) + 1, start = value >> 24 & 7, channel;

    d->regs[offset / 4] = value;
    if (offset != ADC_CR || !start)
        return;
    channel = (uint32_t)__builtin_ctz((value & 255) | 256);
    if (!(value & 1u << 21) || start != 1 || (value & 255) != 1u << channel)
        chip_fault("converter off, or not one channel: 0x%08x", value);
    if (chip.core_hz / lpc_divider(d) / divider > 13000000)
        chip_fault("converter at %u Hz",
                   chip.core_hz / lpc_divider(d) / divider);
    if (chip.is_broken)
        return;
    if (lpc_function_of(pins[channel]) != functions[channel])
        chip_fault("pin of channel %u is not analog", channel);
    d->shift = channel | (uint32_t)pins[channel] << 8;
    bus_plan(d, CONVERSION_CLOCKS * divider * lpc_divider(d));
}

static void
converter_event(struct device *d)
{
    uint32_t channel = d->shift & 255;
    uint32_t value = chip.host.adc_in(chip.host.ctx, chip_now(), d->shift >> 8);

    d->regs[ADC_GDR / 4] = d->regs[ADC_DR / 4 + channel]
        = (value & 0xfff0) | DONE;
}

static uint32_t
converter_read(struct device *d, uint32_t offset)
{
    uint32_t value = d->regs[offset / 4];

    if (offset >= ADC_DR && offset < ADC_DR + 32)
        d->regs[offset / 4] &= ~DONE;
    return value;
}

const struct device_ops lpc_adc_ops = {
    NULL, converter_read, converter_write, converter_event,
};

/*
 * Pwm.  What is latched: regs[64] up, a match register each.
 */

enum { TCR = 1, PR = 3, MCR = 5, PCR = 0x4c / 4, LER = 0x50 / 4, LATCHED = 64 };

static const struct {
    uint8_t pin, channel, function;
} pwm_pins[] = {
    { 50, 1, 2 }, { 52, 2, 2 }, { 53, 3, 2 }, { 55, 4, 2 }, { 56, 5, 2 },
    { 58, 6, 2 }, { 64, 1, 1 }, { 65, 2, 1 }, { 66, 3, 1 }, { 67, 4, 1 },
    { 68, 5, 1 }, { 69, 6, 1 }, { 121, 2, 3 }, { 122, 3, 3 },
};
static uint32_t pwm_told[14][3];

void
lpc_update_pwm(void)
{
    const struct device *d = bus_find(LPC_PWM, 1);
    const uint32_t *match = &d->regs[LATCHED];
    uint32_t i;

    for (i = 0; i < sizeof(pwm_pins) / sizeof(pwm_pins[0]); i++) {
        uint32_t now[3], channel = pwm_pins[i].channel;

        if (lpc_function_of(pwm_pins[i].pin) != pwm_pins[i].function
            || (d->regs[TCR] & 0xb) != 9 || !(d->regs[MCR] & 2)
            || !(d->regs[PCR] & 1u << (8 + channel)))
            continue;
        now[2] = match[0] + 1;
        now[0] = now[2] * (d->regs[PR] + 1) * lpc_divider(d);
        now[1] = match[channel] > now[2] ? now[2] : match[channel];
        if (!memcmp(pwm_told[i], now, sizeof(now)))
            continue;
        memcpy(pwm_told[i], now, sizeof(now));
        chip.host.pwm_out(chip.host.ctx, chip_now(), pwm_pins[i].pin, now[0],
                          now[1], now[2]);
    }
}

/* The latches take the match registers over at once: the model does not count.
 */
static void
pwm_write(struct device *d, uint32_t offset, uint32_t value)
{
    uint32_t i;

    d->regs[offset / 4] = value;
    for (i = 0; offset / 4 == LER && i < 7; i++)
        if (value >> i & 1)
            d->regs[LATCHED + i] = d->regs[i < 4 ? 6 + i : 0x40 / 4 + i - 4];
    if (offset / 4 == LER)
        d->regs[LER] = 0;
    lpc_update_pwm();
}

static void
pwm_reset(struct device *d)
{
    (void)d;
    memset(pwm_told, 0, sizeof(pwm_told));
}

const struct device_ops lpc_pwm_ops = { pwm_reset, NULL, pwm_write, NULL };

/*
 * Watchdog, of the internal oscillator
 */

enum { WDMOD = 0, WDTC = 4, WDFEED = 8, WDCLKSEL = 0x10 };

static void
wdt_write(struct device *d, uint32_t offset, uint32_t value)
{
    uint32_t count = d->regs[WDTC / 4] < 255 ? 255 : d->regs[WDTC / 4];

    if (d->shift == 0xaa && (offset != WDFEED || value != 0x55))
        chip_fault("the watchdog's two words are torn apart");
    if (offset != WDFEED) {
        d->regs[offset / 4] = value;
        return;
    }
    if (value == 0xaa) {
        d->shift = value;
        return;
    }
    d->shift = 0;
    if ((d->regs[WDMOD / 4] & 3) != 3)
        return;
    if (d->regs[WDCLKSEL / 4] & 3)
        chip_fault("watchdog of another clock");
    bus_plan(d, (uint64_t)count * chip.core_hz / 1000000);
}

static void
wdt_event(struct device *d)
{
    (void)d;
    chip.wants_reset = true;
}

const struct device_ops lpc_wdt_ops = { NULL, NULL, wdt_write, wdt_event };
