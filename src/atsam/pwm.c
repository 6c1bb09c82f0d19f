/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pulse widths in hardware: each channel has a cycle time of its own and can
 * drive several pins, of which one is used (11057, 38.6). */
#include "board/pwm.h"
#include "chip.h"
#include "core/sched.h"
#include "pwm_pins.h"

#define PWM_SHIFT 15
DECL_CONSTANT("PWM_MAX", 32768);

/* Counters have 16 bits; their clock may be divided by up to 2^10 */
#define PERIOD_MAX 65535u
#define PRESCALER_MAX 10u

static const struct pwm_pin {
    uint8_t pin;
    char peripheral;
    uint8_t channel;
    bool is_high;
} pins[] = { PWM_PINS };
#define N_PINS (sizeof(pins) / sizeof(pins[0]))

/* Pin of each channel, plus one */
static uint8_t users[8];

static const struct pwm_pin *find_pin(uint32_t pin)
{
    const struct pwm_pin *found = pins;

    while (found < pins + N_PINS && found->pin != pin)
        found++;
    if (found == pins + N_PINS)
        shutdown("Not a valid PWM pin");
    return found;
}

static struct pwm_regs *open_unit(uint8_t channel)
{
#if CONFIG_MACH_SAME70
    if (channel >= 4) {
        chip_enable(PWM1_ID);
        return (struct pwm_regs *)PWM1_BASE;
    }
#endif
    (void)channel;
    chip_enable(PWM_ID);
    return (struct pwm_regs *)PWM_BASE;
}

/* A cycle begins with `duty` counts of the level that means on: CPOL starts
 * high; without, it starts low and the complement high. */
struct gpio_pwm pwm_setup(uint32_t pin, uint32_t cycle_ticks, uint16_t value)
{
    const struct pwm_pin *p = find_pin(pin);
    struct pwm_regs *regs = open_unit(p->channel);
    uint32_t index = CONFIG_MACH_SAME70 ? p->channel % 4u : p->channel;
    struct pwm_channel *channel = &regs->channels[index];
    uint32_t period = cycle_ticks / MCK_TICKS, prescaler = 0;

    if (users[p->channel] && users[p->channel] != pin + 1)
        shutdown("PWM channel already in use");
    users[p->channel] = (uint8_t)(pin + 1);
    while (period > PERIOD_MAX && prescaler < PRESCALER_MAX) {
        period /= 2;
        prescaler++;
    }
    if (period > PERIOD_MAX)
        period = PERIOD_MAX;
    if (period < 2)
        period = 2;
    regs->DIS = 1u << index;
    while (regs->SR & 1u << index)
        ;
    channel->CMR = prescaler | (p->is_high ? PWM_CMR_CPOL : 0);
    channel->CPRD = period;
    channel->CDTY = (period * value) >> PWM_SHIFT;
    regs->ENA = 1u << index;
    gpio_alternate(pin, p->peripheral, 0);
    return (struct gpio_pwm) { &channel->CDTYUPD, period };
}

void pwm_write(struct gpio_pwm pwm, uint16_t value)
{
    *pwm.duty = (pwm.period * value) >> PWM_SHIFT;
}
