/* SPDX-License-Identifier: GPL-3.0-or-later
 * Hardware pwm: channels of pwm chips. */
#include <stddef.h>

#include "board/pwm.h"
#include "core/sched.h"
#include "devices.h"
#include "pins.h"

#define PWM_MAX 32768
#define NS_PER_TICK (1000000000 / CONFIG_CLOCK_FREQ)

DECL_CONSTANT("PWM_MAX", PWM_MAX);
DECL_ENUMERATION_RANGE("pin", "pwmchip0/pwm0", PINS_PWM(0),
                       PINS_PWM_CHANNELS);
DECL_ENUMERATION_RANGE("pin", "pwmchip1/pwm0", PINS_PWM(1),
                       PINS_PWM_CHANNELS);
DECL_ENUMERATION_RANGE("pin", "pwmchip2/pwm0", PINS_PWM(2),
                       PINS_PWM_CHANNELS);
DECL_ENUMERATION_RANGE("pin", "pwmchip3/pwm0", PINS_PWM(3),
                       PINS_PWM_CHANNELS);
DECL_ENUMERATION_RANGE("pin", "pwmchip4/pwm0", PINS_PWM(4),
                       PINS_PWM_CHANNELS);
DECL_ENUMERATION_RANGE("pin", "pwmchip5/pwm0", PINS_PWM(5),
                       PINS_PWM_CHANNELS);
DECL_ENUMERATION_RANGE("pin", "pwmchip6/pwm0", PINS_PWM(6),
                       PINS_PWM_CHANNELS);
DECL_ENUMERATION_RANGE("pin", "pwmchip7/pwm0", PINS_PWM(7),
                       PINS_PWM_CHANNELS);

struct pwm_channel {
    int handle;
    bool is_open;
    uint16_t value;
    uint64_t cycle_ns;
};

static struct pwm_channel channels[PINS_PWM_CHIPS * PINS_PWM_CHANNELS];

static uint64_t on_ns(const struct pwm_channel *channel)
{
    return channel->cycle_ns * channel->value / PWM_MAX;
}

static struct pwm_channel *open_channel(uint32_t pin)
{
    struct pwm_channel *channel;

    if (pin < PINS_PWM(0) || pin >= PINS_PWM(PINS_PWM_CHIPS))
        return NULL;
    channel = &channels[pin - PINS_PWM(0)];
    if (channel->is_open)
        return channel;
    channel->handle = devices.pwm->open(
        (pin - PINS_PWM(0)) / PINS_PWM_CHANNELS,
        (pin - PINS_PWM(0)) % PINS_PWM_CHANNELS);
    channel->is_open = channel->handle >= 0;
    return channel->is_open ? channel : NULL;
}

struct gpio_pwm pwm_setup(uint32_t pin, uint32_t cycle_ticks, uint16_t value)
{
    struct pwm_channel *channel = open_channel(pin);

    if (!channel)
        shutdown("Not a valid PWM pin");
    channel->cycle_ns = (uint64_t)(cycle_ticks ? cycle_ticks : 1)
        * NS_PER_TICK;
    channel->value = value < PWM_MAX ? value : PWM_MAX;
    if (devices.pwm->set_cycle(channel->handle, channel->cycle_ns,
                               on_ns(channel)) < 0)
        shutdown("PWM already programmed at different speed");
    return (struct gpio_pwm){ channel };
}

void pwm_write(struct gpio_pwm pwm, uint16_t value)
{
    struct pwm_channel *channel = pwm.channel;

    value = value < PWM_MAX ? value : PWM_MAX;
    if (value == channel->value)
        return;
    channel->value = value;
    if (devices.pwm->set_on(channel->handle, on_ns(channel)) < 0)
        try_shutdown("Pwm write failed");
}
