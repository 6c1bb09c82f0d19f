/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pulse widths in hardware: the channels of general timers (RM0008, 15.3). */
#include "board/irq.h"
#include "board/pwm.h"
#include "chip.h"
#include "core/sched.h"
#include "pwm_pins.h"

#define PWM_SHIFT 15
DECL_CONSTANT("PWM_MAX", 32768);

/* One less than a counter of 16 bits can do, so that "always on" fits. */
#define PERIOD_MAX 65535u

struct timer_unit {
    struct tim_regs *regs;
    uint16_t gate;
    uint8_t number, bus;
};
#define TIMER_ENTRY(N, BUS) \
    { (struct tim_regs *)TIM##N##_BASE, TIM##N##_GATE, N, BUS },
static const struct timer_unit units[] = { TIMERS(TIMER_ENTRY) };

struct channel {
    uint8_t pin, timer, channel, function;
};
#define CHANNEL_ENTRY(PIN, TIMER, CHANNEL, FUNCTION) \
    { PIN, TIMER, CHANNEL - 1, FUNCTION },
static const struct channel channels[] = { CHANNELS(CHANNEL_ENTRY) };
#define N_CHANNELS (sizeof(channels) / sizeof(channels[0]))

static const struct channel *find_channel(uint32_t pin)
{
    const struct channel *channel = channels;

    while (channel < channels + N_CHANNELS && channel->pin != pin)
        channel++;
    if (channel == channels + N_CHANNELS)
        shutdown("Not a valid PWM pin");
    return channel;
}

static const struct timer_unit *find_unit(uint8_t number)
{
    const struct timer_unit *unit = units;

    while (unit->number != number)
        unit++;
    return unit;
}

static void connect(const struct channel *channel)
{
#if CONFIG_MACH_STM32F1
    /* shift of the timer's field in AFIO_MAPR; that of timer 4 is one bit */
    static const uint8_t shifts[] = { 0, 6, 8, 10, 12 };
    uint32_t mask = channel->timer == 4 ? 1 : 3;
    uint32_t shift = shifts[channel->timer];

    gpio_remap(mask << shift, (uint32_t)channel->function << shift);
#endif
    gpio_alternate(channel->pin, channel->function, 0);
}

/* Run at this speed; another channel may have asked for the same already. */
static void start(const struct timer_unit *unit, uint32_t prescaler,
                  uint32_t period)
{
    struct tim_regs *regs = unit->regs;

    if (regs->CR1 & TIM_CR1_CEN) {
        if (regs->PSC != prescaler || regs->ARR != period - 1)
            shutdown("PWM already programmed at different speed");
        return;
    }
    regs->PSC = prescaler;
    regs->ARR = period - 1;
    regs->EGR = TIM_EGR_UG;
    regs->BDTR = TIM_BDTR_MOE;
    regs->CR1 = TIM_CR1_ARPE | TIM_CR1_CEN;
}

struct gpio_pwm pwm_setup(uint32_t pin, uint32_t cycle_ticks, uint16_t value)
{
    const struct channel *channel = find_channel(pin);
    const struct timer_unit *unit = find_unit(channel->timer);
    uint32_t counts = cycle_ticks / (unit->bus == 1 ? BUS1_TIMER_DIVIDER : 1);
    uint32_t prescaler, shift = 8 * (channel->channel % 2u);
    volatile uint32_t *mode = &unit->regs->CCMR[channel->channel / 2];
    struct gpio_pwm pwm;

    if (counts < 2)
        counts = 2;
    prescaler = (counts - 1) / PERIOD_MAX;
    if (prescaler > PERIOD_MAX)
        prescaler = PERIOD_MAX;
    pwm.period = counts / (prescaler + 1);
    if (pwm.period > PERIOD_MAX)
        pwm.period = PERIOD_MAX;
    pwm.compare = &unit->regs->CCR[channel->channel];
    chip_enable(unit->gate);
    pwm_write(pwm, value);
    *mode = (*mode & ~(0xffu << shift)) | TIM_CCMR_PWM1_PRELOAD << shift;
    unit->regs->CCER |= 1u << (4 * channel->channel);
    start(unit, prescaler, pwm.period);
    connect(channel);
    return pwm;
}

void pwm_write(struct gpio_pwm pwm, uint16_t value)
{
    *pwm.compare = (value * pwm.period) >> PWM_SHIFT;
}
