/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Converters: ADC of SAM3X and SAM4S (11057, chapter 43), AFEC of SAM4E and SAM
 * E70 (11157, chapter 43; DS60001527, chapter 52).
 */
#include "unicorn_sam.h"

enum { CR = 0, MR = 4, LCDR = 0x20, ISR = 0x30, CSELR = 0x64, COCR = 0x6c,
       ACR = 0x94 };
#define DRDY (1u << 24)
/* Offset of each channel: words that the registers leave free */
enum { OFFSETS = 200 };

static bool
is_afec(const struct device *d)
{
    return d->info->kind == SAM_AFEC;
}

/* CHSR: the channels that are on; CHER and CHDR come before it */
static uint32_t *
channels_of(struct device *d)
{
    return &d->regs[(is_afec(d) ? 0x1c : 0x18) / 4];
}

static uint32_t
clock_hz(const struct device *d)
{
    uint32_t prescal = d->regs[MR / 4] >> 8 & 255;

    return chip.bus_hz[1] / (prescal + 1) / (sam_line() == SAME70 ? 1 : 2);
}

static void
check_afec(struct device *d, uint32_t channel)
{
    uint32_t middle = sam_line() == SAME70 ? 0x200 : 0x800;

    if (!(d->regs[MR / 4] & 1u << 23))
        chip_fault("AFEC without its bit 23 of MR");
    if (d->regs[OFFSETS + channel] != middle)
        chip_fault("AFEC channel %u with offset 0x%x", channel,
                   d->regs[OFFSETS + channel]);
    if (sam_line() == SAME70 && (d->regs[ACR / 4] >> 2 & 3) != 3)
        chip_fault("AFEC without its amplifiers");
}

static void
start(struct device *d)
{
    uint32_t on = *channels_of(d), hz = clock_hz(d), channel;
    uint32_t limit = sam_line() == SAME70 ? 40000000 : 20000000;
    int pin;

    channel = (uint32_t)__builtin_ctz(on | 1u << 31);
    if (on != 1u << channel || hz > limit || hz < 1000000) {
        chip_fault("converter with channels 0x%x at %u Hz", on, hz);
        return;
    }
    if (d->due != NEVER)
        chip_fault("converter started while it works");
    if (is_afec(d))
        check_afec(d, channel);
    pin = chip.model->adc_pin(d->info->index, (uint8_t)channel);
    if (pin >= 0 && sam_function_of((uint32_t)pin) != SAM_INPUT)
        chip_fault("pin %d of channel %u is no input", pin, channel);
    d->shift = (uint32_t)pin;
    bus_plan(d, 40ull * (chip.core_hz / hz));
}

static void
converter_event(struct device *d)
{
    uint32_t value = 0;

    if ((int32_t)d->shift >= 0)
        value = chip.host.adc_in(chip.host.ctx, chip_now(), d->shift);
    d->regs[LCDR / 4] = value >> 4;
    d->regs[ISR / 4] |= DRDY;
}

static void
converter_write(struct device *d, uint32_t offset, uint32_t value)
{
    uint32_t enable = is_afec(d) ? 0x14 : 0x10;

    if (offset == enable)
        *channels_of(d) |= value;
    else if (offset == enable + 4)
        *channels_of(d) &= ~value;
    else if (offset == CR && value & 2)
        start(d);
    else if (offset == COCR && is_afec(d))
        d->regs[OFFSETS + (d->regs[CSELR / 4] & 15)] = value;
    else if (offset != CR)
        d->regs[offset / 4] = value;
}

static uint32_t
converter_read(struct device *d, uint32_t offset)
{
    if (offset == LCDR)
        d->regs[ISR / 4] &= ~DRDY;
    return d->regs[offset / 4];
}

const struct device_ops sam_adc_ops = {
    NULL, converter_read, converter_write, converter_event,
};
const struct device_ops sam_afec_ops = {
    NULL, converter_read, converter_write, converter_event,
};
