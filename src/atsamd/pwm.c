/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pulse widths in hardware: the channels of the three TCC (DS40001882, 31;
 * DS60001479, 36). */
#include "board/pwm.h"
#include "chip.h"
#include "core/sched.h"

#define PWM_SHIFT 15
DECL_CONSTANT("PWM_MAX", 32768);

/* Counters of 16 bits, one less so that "always on" fits; two have more */
#define PERIOD_MAX 65535u

struct output {
    uint8_t pin, mux, timer, channel;
};
#define X(LETTER, BIT, MUX, TIMER, CHANNEL) \
    { GPIO(LETTER, BIT), MUX, TIMER, CHANNEL }
/* Outputs above the number of channels repeat these */
static const struct output outputs[] = {
    X('A', 4, MUX_E, 0, 0), X('A', 5, MUX_E, 0, 1), X('A', 6, MUX_E, 1, 0),
    X('A', 7, MUX_E, 1, 1), X('A', 8, MUX_E, 0, 0), X('A', 9, MUX_E, 0, 1),
    X('A', 10, MUX_F, 0, 2), X('A', 11, MUX_F, 0, 3), X('A', 12, MUX_E, 2, 0),
    X('A', 13, MUX_E, 2, 1), X('A', 14, MUX_F, 0, 0), X('A', 15, MUX_F, 0, 1),
    X('A', 16, MUX_E, 2, 0), X('A', 17, MUX_E, 2, 1), X('A', 18, MUX_F, 0, 2),
    X('A', 19, MUX_F, 0, 3), X('A', 20, MUX_F, 0, 2), X('A', 21, MUX_F, 0, 3),
    X('A', 22, MUX_F, 0, 0), X('A', 23, MUX_F, 0, 1), X('A', 24, MUX_F, 1, 0),
    X('A', 25, MUX_F, 1, 1), X('A', 30, MUX_E, 1, 0), X('A', 31, MUX_E, 1, 1),
    X('B', 10, MUX_F, 0, 0), X('B', 11, MUX_F, 0, 1), X('B', 12, MUX_F, 0, 2),
    X('B', 13, MUX_F, 0, 3), X('B', 16, MUX_F, 0, 0), X('B', 17, MUX_F, 0, 1),
    X('B', 30, MUX_E, 0, 0), X('B', 31, MUX_E, 0, 1),
};
#undef X
#define N_OUTPUTS (sizeof(outputs) / sizeof(outputs[0]))

static const struct {
    struct tcc_regs *regs;
    uint16_t gate;
    uint8_t channel;
} timers[] = {
    { (struct tcc_regs *)TCC0_BASE, TCC0_GATE, CHANNEL_TCC0_TCC1 },
    { (struct tcc_regs *)TCC1_BASE, TCC1_GATE, CHANNEL_TCC0_TCC1 },
    { (struct tcc_regs *)TCC2_BASE, TCC2_GATE, CHANNEL_TCC2 },
};

/* PRESCALER: what it divides by, as a power of two */
static const uint8_t shifts[] = { 0, 1, 2, 3, 4, 6, 8, 10 };

static const struct output *find_output(uint32_t pin)
{
    const struct output *output = outputs;

    while (output < outputs + N_OUTPUTS && output->pin != pin)
        output++;
    if (output == outputs + N_OUTPUTS)
        shutdown("Not a valid PWM pin");
    return output;
}

/* Run at this speed; another channel may have asked for the same already. */
static void start(struct tcc_regs *regs, uint32_t prescaler, uint32_t period)
{
    uint32_t ctrla = TCC_CTRLA_PRESCALER(prescaler) | TCC_CTRLA_ENABLE;

    if (regs->CTRLA & TCC_CTRLA_ENABLE) {
        if (regs->CTRLA != ctrla || regs->PER != period - 1)
            shutdown("PWM already programmed at different speed");
        return;
    }
    regs->CTRLA = ctrla & ~TCC_CTRLA_ENABLE;
    regs->WAVE = TCC_WAVE_NPWM;
    while (regs->SYNCBUSY)
        ;
    regs->PER = period - 1;
    while (regs->SYNCBUSY)
        ;
    regs->CTRLA = ctrla;
    while (regs->SYNCBUSY)
        ;
}

struct gpio_pwm pwm_setup(uint32_t pin, uint32_t cycle_ticks, uint16_t value)
{
    const struct output *output = find_output(pin);
    struct gpio_pwm pwm = { timers[output->timer].regs, 0, output->channel };
    uint32_t prescaler = 0;

    while (prescaler < sizeof(shifts) - 1
           && cycle_ticks >> shifts[prescaler] > PERIOD_MAX)
        prescaler++;
    pwm.period = cycle_ticks >> shifts[prescaler];
    if (pwm.period > PERIOD_MAX)
        pwm.period = PERIOD_MAX;
    if (pwm.period < 2)
        pwm.period = 2;
    chip_enable(timers[output->timer].gate);
    chip_feed(timers[output->timer].channel, GEN_PERIPHERALS);
    start(pwm.regs, prescaler, pwm.period);
    pwm.regs->CC[pwm.channel] = (value * pwm.period) >> PWM_SHIFT;
    while (pwm.regs->SYNCBUSY)
        ;
    gpio_mux(pin, output->mux, 0);
    return pwm;
}

/* A value that is under way to the timer's clock is soon there. */
void pwm_write(struct gpio_pwm pwm, uint16_t value)
{
    uint32_t compare = (value * pwm.period) >> PWM_SHIFT;

    while (pwm.regs->SYNCBUSY)
        ;
    pwm.regs->CCB[pwm.channel] = compare;
}
