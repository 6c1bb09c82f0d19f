/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pulse widths in hardware: each pin belongs to a channel of a slice (data
 * sheet, 4.5). */
#include "board/pwm.h"
#include "chip.h"
#include "core/sched.h"

#define PWM_SHIFT 15
DECL_CONSTANT("PWM_MAX", 32768);

/* One less than the counter can do, so that "always on" fits. */
#define PERIOD_MAX 65535u
/* The divider has 8 bits and 4 of a fraction */
#define DIVIDER_MAX 0xfffu

#define SLICE(N) (&((struct pwm_slice *)PWM_BASE)[N])

/* Pins from 32 on have four slices of their own. */
static uint32_t find_slice(uint32_t pin)
{
    return pin < 32 ? pin / 2 % 8 : 8 + pin / 2 % 4;
}

/* Run at this speed; the other channel may have asked for the same already. */
static void start(struct pwm_slice *slice, uint32_t divider, uint32_t period)
{
    if (slice->CSR & PWM_CSR_EN) {
        if (slice->DIV != divider || slice->TOP != period - 1)
            shutdown("PWM already programmed at different speed");
        return;
    }
    slice->DIV = divider;
    slice->TOP = period - 1;
    slice->CTR = 0;
    slice->CSR = PWM_CSR_EN;
}

struct gpio_pwm pwm_setup(uint32_t pin, uint32_t cycle_ticks, uint16_t value)
{
    struct pwm_slice *slice = SLICE(find_slice(pin));
    uint64_t sixteenths = (uint64_t)cycle_ticks * (16 * SYS_MHZ)
        / (CONFIG_CLOCK_FREQ / 1000000);
    uint32_t divider, period;
    struct gpio_pwm pwm;

    if (pin >= N_PINS)
        shutdown("Not a valid PWM pin");
    divider = (uint32_t)((sixteenths + PERIOD_MAX - 1) / PERIOD_MAX);
    if (divider < 16)
        divider = 16;
    if (sixteenths > (uint64_t)DIVIDER_MAX * PERIOD_MAX)
        divider = DIVIDER_MAX;
    period = (uint32_t)(sixteenths / divider);
    period = period > PERIOD_MAX ? PERIOD_MAX : period < 2 ? 2 : period;
    chip_enable(RESET_PWM);
    pwm = (struct gpio_pwm) { &slice->CC, period, pin % 2 ? 16 : 0 };
    pwm_write(pwm, value);
    start(slice, divider, period);
    gpio_function(pin, IO_PWM, 0);
    return pwm;
}

/* The other half is another pin's. */
void pwm_write(struct gpio_pwm pwm, uint16_t value)
{
    uint32_t compare = (value * pwm.period) >> PWM_SHIFT;
    uint32_t change = ((*pwm.compares >> pwm.shift) ^ compare) & 0xffff;

    RP_XOR(*pwm.compares) = change << pwm.shift;
}
