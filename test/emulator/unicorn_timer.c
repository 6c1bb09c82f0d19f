/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Timers of an STM32: what the program counts with, and pwm.
 */
#include <string.h>

#include "unicorn_chip.h"

/*
 * Counting
 */

enum { TIM_CR1 = 0, TIM_CNT = 9, TIM_PSC = 10 };

/* From an overflow of the lower timer to the count of the upper one */
#define CHAIN_CYCLES 3

/* Timer 1 counts the overflows of timer 3 where that is the clock. */
static uint32_t
count_ticks(struct device *d)
{
    bool is_chained = chip.model->clock_timer == 3;
    uint64_t ticks = chip.cycle - d->zero;

    if (!(d->regs[TIM_CR1] & 1))
        return d->regs[TIM_CNT];
    if (is_chained && d->info->index == 1)
        return ticks < CHAIN_CYCLES ? 0
            : (uint32_t)((chip.cycle - chip.cyccnt_zero - CHAIN_CYCLES) >> 16)
            & 0xffff;
    ticks /= d->regs[TIM_PSC] + 1;
    return (uint32_t)ticks & (is_chained ? 0xffff : UINT32_MAX);
}

uint32_t
timer_read(struct device *d, uint32_t word)
{
    return word == TIM_CNT ? count_ticks(d) : d->regs[word];
}

void
timer_write(struct device *d, uint32_t word, uint32_t value)
{
    bool starts = word == TIM_CR1 && value & 1 && !(d->regs[TIM_CR1] & 1);

    d->regs[word] = value;
    timer_update_pwm();
    if (!starts)
        return;
    d->zero = chip.cycle;
    if (d->info->index == chip.model->clock_timer && !chip.is_counting) {
        chip.cyccnt_zero = chip.cycle;
        chip.is_counting = true;
        chip_wake_at(chip.cycle);
    }
}

/*
 * Pwm
 */

static struct device *
find_kind(enum device_kind kind, uint8_t index)
{
    uint32_t i;

    for (i = 0; i < chip.n_devices; i++)
        if (chip.devices[i].info->kind == kind
            && chip.devices[i].info->index == index)
            return &chip.devices[i];
    return NULL;
}

/* Is this pin driven by its timer's channel? */
static bool
is_pwm_on(const struct pwm_info *pwm, const struct device *timer)
{
    const struct device *port = find_kind(DEV_GPIO, pwm->pin / 16);
    uint32_t bit = pwm->pin % 16, channel = pwm->channel;
    int8_t pull;

    if (!port || !timer || gpio_mode_of(port, bit, &pull) != 2)
        return false;
    if (chip.model->gpio_v2
        && ((port->regs[8 + bit / 8] >> (4 * (bit % 8))) & 15) != pwm->function)
        return false;
    /* CEN, CCxE, OCxM of pwm mode 1; MOE of those with a break input */
    if (timer->info->index >= 15 && !(timer->regs[17] & (1u << 15)))
        return false;
    return timer->regs[0] & 1 && timer->regs[8] & (1u << (4 * channel))
        && ((timer->regs[6 + channel / 2] >> (8 * (channel % 2))) & 0x70)
        == 0x60;
}

/* Registers of a timer or a pin have changed. */
void
timer_update_pwm(void)
{
    const struct pwm_info *pwm = chip.model->pwm;
    uint32_t i;

    for (i = 0; pwm[i].timer; i++) {
        const struct device *timer = find_kind(DEV_TIM, pwm[i].timer);
        uint32_t *told = chip.pwm_told[i], now[3], hz;

        if (!is_pwm_on(&pwm[i], timer))
            continue;
        hz = chip.bus_hz[timer->info->bus];
        now[0] = (timer->regs[10] + 1) * (timer->regs[11] + 1)
            * (chip.core_hz / (hz < chip.core_hz ? 2 * hz : hz));
        now[1] = timer->regs[13 + pwm[i].channel];
        now[2] = timer->regs[11] + 1;
        if (!memcmp(told, now, sizeof(now)))
            continue;
        memcpy(told, now, sizeof(now));
        chip.host.pwm_out(chip.host.ctx, chip_now(), pwm[i].pin, now[0], now[1],
                          now[2]);
    }
}

