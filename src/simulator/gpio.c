/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins of the simulated mcu.  Every pin can be anything. */
#include "board/adc.h"
#include "board/gpio.h"
#include "board/pwm.h"
#include "core/sched.h"
#include "world.h"

#define ADC_MAX 4095
#define PWM_MAX 32768

DECL_ENUMERATION_RANGE("pin", "gpio0", 0, 256);
DECL_ENUMERATION("pin", "ADC_TEMPERATURE", 254);
DECL_CONSTANT("ADC_MAX", ADC_MAX);
DECL_CONSTANT("PWM_MAX", PWM_MAX);

static uint8_t levels[SIMULATOR_PINS];
static uint8_t is_output[SIMULATOR_PINS];
static int8_t pulls[SIMULATOR_PINS];
static uint32_t cycles[SIMULATOR_PINS];


/* ---- Digital ---- */

static void set_level(uint8_t pin, uint8_t level)
{
    levels[pin] = level;
    simulator.host->pin_out(simulator.host->ctx, simulator_clock(), pin,
                            level);
}

struct gpio_out gpio_setup_output(uint32_t pin, uint8_t level)
{
    struct gpio_out out = { (uint8_t)pin };

    if (pin >= SIMULATOR_PINS)
        shutdown("Not an output pin");
    gpio_drive(out, level);
    return out;
}

void gpio_drive(struct gpio_out out, uint8_t level)
{
    bool was_driven = is_output[out.pin] && levels[out.pin] == !!level;

    is_output[out.pin] = 1;
    if (!was_driven)
        set_level(out.pin, !!level);
}

void gpio_write(struct gpio_out out, uint8_t level)
{
    if (levels[out.pin] != !!level)
        set_level(out.pin, !!level);
}

void gpio_toggle(struct gpio_out out)
{
    gpio_toggle_irq(out);
}

void gpio_toggle_irq(struct gpio_out out)
{
    set_level(out.pin, !levels[out.pin]);
}

struct gpio_in gpio_setup_input(uint32_t pin, int8_t pull)
{
    struct gpio_in in = { (uint8_t)pin };

    if (pin >= SIMULATOR_PINS || pull < -1 || pull > 1)
        shutdown("Not a valid input pin");
    gpio_float(in, pull);
    return in;
}

/* What was driven is now left to its pull: the world sees that level. */
void gpio_float(struct gpio_in in, int8_t pull)
{
    if (is_output[in.pin] && pull && levels[in.pin] != (pull > 0))
        set_level(in.pin, pull > 0);
    is_output[in.pin] = 0;
    pulls[in.pin] = pull;
}

uint8_t gpio_read(struct gpio_in in)
{
    if (is_output[in.pin])
        return levels[in.pin];
    return !!simulator.host->pin_in(simulator.host->ctx, simulator_clock(),
                                    in.pin, pulls[in.pin]);
}


/* ---- Analog ---- */

struct gpio_adc adc_setup(uint32_t pin)
{
    if (pin >= SIMULATOR_PINS)
        shutdown("Not a valid ADC pin");
    return (struct gpio_adc){ (uint8_t)pin };
}

uint32_t adc_sample(struct gpio_adc adc)
{
    (void)adc;
    return 0;
}

uint16_t adc_read(struct gpio_adc adc)
{
    uint32_t v = simulator.host->adc_in(simulator.host->ctx,
                                        simulator_clock(), adc.pin);

    return (uint16_t)((v * (ADC_MAX + 1)) >> 16);
}

void adc_cancel(struct gpio_adc adc)
{
    (void)adc;
}


/* ---- Pwm ---- */

struct gpio_pwm pwm_setup(uint32_t pin, uint32_t cycle_ticks, uint16_t value)
{
    struct gpio_pwm pwm = { (uint8_t)pin };

    if (pin >= SIMULATOR_PINS)
        shutdown("Not a valid PWM pin");
    cycles[pin] = cycle_ticks ? cycle_ticks : 1;
    pwm_write(pwm, value);
    return pwm;
}

void pwm_write(struct gpio_pwm pwm, uint16_t value)
{
    simulator.host->pwm_out(simulator.host->ctx, simulator_clock(), pwm.pin,
                            cycles[pwm.pin],
                            value < PWM_MAX ? value : PWM_MAX, PWM_MAX);
}
