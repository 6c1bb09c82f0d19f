/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pulse widths in hardware: six channels of PWM1, which share one cycle time
 * (UM10360, chapter 24). */
#include "board/irq.h"
#include "board/pwm.h"
#include "chip.h"
#include "core/sched.h"

#define PWM_SHIFT 15
DECL_CONSTANT("PWM_MAX", 32768);

#define REGS ((struct pwm_regs *)PWM1_BASE)
/* A value times the cycle fits into 32 bits: more counts are prescaled */
#define COUNTS_MAX 65536u

static const struct {
    uint8_t pin, channel, function;
} channels[] = {
    { GPIO(1, 18), 1, 2 }, { GPIO(1, 20), 2, 2 }, { GPIO(1, 21), 3, 2 },
    { GPIO(1, 23), 4, 2 }, { GPIO(1, 24), 5, 2 }, { GPIO(1, 26), 6, 2 },
    { GPIO(2, 0), 1, 1 }, { GPIO(2, 1), 2, 1 }, { GPIO(2, 2), 3, 1 },
    { GPIO(2, 3), 4, 1 }, { GPIO(2, 4), 5, 1 }, { GPIO(2, 5), 6, 1 },
    { GPIO(3, 25), 2, 3 }, { GPIO(3, 26), 3, 3 },
};
#define N_CHANNELS (sizeof(channels) / sizeof(channels[0]))

static volatile uint32_t *find_match(uint8_t channel)
{
    return channel < 4 ? &REGS->MR0_3[channel] : &REGS->MR4_6[channel - 4];
}

/* Run at this speed; another channel may have asked for the same already. */
static void start(uint32_t prescaler, uint32_t counts)
{
    chip_enable(PWM1_POWER);
    if (REGS->TCR & PWM_TCR_ENABLE) {
        if (REGS->PR != prescaler || REGS->MR0_3[0] != counts - 1)
            shutdown("PWM already programmed at different speed");
        return;
    }
    REGS->TCR = PWM_TCR_RESET;
    REGS->PR = prescaler;
    REGS->MCR = PWM_MCR_MR0_RESET;
    REGS->MR0_3[0] = counts - 1;
    REGS->LER = 1;
    REGS->TCR = PWM_TCR_ENABLE | PWM_TCR_PWM;
}

/* A match beyond the cycle is always on, one at 0 never (24.5.1).  The cycle
 * is in the first match register. */
void pwm_write(struct gpio_pwm pwm, uint16_t value)
{
    *pwm.match = ((REGS->MR0_3[0] + 1) * value) >> PWM_SHIFT;
    REGS->LER |= pwm.latch;
}

struct gpio_pwm pwm_setup(uint32_t pin, uint32_t cycle_ticks, uint16_t value)
{
    uint32_t counts = cycle_ticks < 2 ? 2 : cycle_ticks, i = 0;
    uint32_t prescaler = (counts - 1) / COUNTS_MAX;
    struct gpio_pwm pwm;
    irq_flag_t flag;

    while (i < N_CHANNELS && channels[i].pin != pin)
        i++;
    if (i == N_CHANNELS)
        shutdown("Not a valid PWM pin");
    start(prescaler, counts / (prescaler + 1));
    pwm.match = find_match(channels[i].channel);
    pwm.latch = 1u << channels[i].channel;
    flag = irq_save();
    pwm_write(pwm, value);
    REGS->PCR |= PWM_PCR_ENABLE(channels[i].channel);
    irq_restore(flag);
    gpio_alternate(pin, channels[i].function, 0);
    return pwm;
}
