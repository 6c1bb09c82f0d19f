/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pulse widths in hardware: 8 bits, phase correct, a cycle of 510 counts.
 * Timer 1 is the clock; its pins have none. */
#include "board/gpio.h"
#include "board/mem.h"
#include "board/pwm.h"
#include "core/sched.h"

#define PWM_MAX 255
DECL_CONSTANT("PWM_MAX", PWM_MAX);

#define CYCLE_COUNTS 510

struct channel {
    uint8_t pin;
    volatile uint8_t *compare;  /* OCRnx, its low byte */
    volatile uint8_t *control;  /* TCCRnA; TCCRnB follows */
    uint8_t connect;            /* COMnx1 */
    uint8_t is_timer2, is_wide; /* other prescalers; 16 bit compare */
};

#define NARROW(PORT, BIT, N, X) \
    { PIN_NUMBER(PORT, BIT), &OCR##N##X, &TCCR##N##A, 1 << COM##N##X##1, \
      N == 2, 0 }
#define WIDE(PORT, BIT, N, X) \
    { PIN_NUMBER(PORT, BIT), &OCR##N##X##L, &TCCR##N##A, \
      1 << COM##N##X##1, 0, 1 }

static const ROM struct channel channels[] = {
#if CONFIG_AVR_MEGA
    NARROW('B', 7, 0, A), NARROW('G', 5, 0, B),
    NARROW('B', 4, 2, A), NARROW('H', 6, 2, B),
    WIDE('E', 3, 3, A), WIDE('E', 4, 3, B), WIDE('E', 5, 3, C),
    WIDE('H', 3, 4, A), WIDE('H', 4, 4, B), WIDE('H', 5, 4, C),
    WIDE('L', 3, 5, A), WIDE('L', 4, 5, B), WIDE('L', 5, 5, C),
#elif CONFIG_AVR_AT90USB
    NARROW('B', 7, 0, A), NARROW('D', 0, 0, B),
    NARROW('B', 4, 2, A), NARROW('D', 1, 2, B),
    WIDE('C', 6, 3, A), WIDE('C', 5, 3, B), WIDE('C', 4, 3, C),
#elif CONFIG_AVR_U4
    NARROW('B', 7, 0, A), NARROW('D', 0, 0, B), WIDE('C', 6, 3, A),
#elif CONFIG_AVR_X4
    NARROW('B', 3, 0, A), NARROW('B', 4, 0, B),
    NARROW('D', 7, 2, A), NARROW('D', 6, 2, B),
#if CONFIG_MACH_atmega1284p
    WIDE('B', 6, 3, A), WIDE('B', 7, 3, B),
#endif
#else
    NARROW('D', 6, 0, A), NARROW('D', 5, 0, B),
    NARROW('B', 3, 2, A), NARROW('D', 3, 2, B),
#endif
};
#define N_CHANNELS (sizeof(channels) / sizeof(channels[0]))

/* Powers of two that the prescalers divide by; the index + 1 is CSn. */
static const ROM uint8_t shifts[] = { 0, 3, 6, 8, 10 };
static const ROM uint8_t shifts_timer2[] = { 0, 3, 5, 6, 7, 8, 10 };

/* The prescaler whose cycle is nearest above, or the longest. */
static uint8_t choose_prescaler(const ROM uint8_t *table, uint8_t count,
                                uint32_t cycle_ticks)
{
    uint8_t i = 0;

    while (i < count - 1
           && ((uint32_t)CYCLE_COUNTS << table[i]) < cycle_ticks)
        i++;
    return (uint8_t)(i + 1);
}

struct gpio_pwm pwm_setup(uint32_t pin, uint32_t cycle_ticks, uint16_t value)
{
    struct gpio_pwm pwm = { 0 };
    volatile uint8_t *control;
    uint8_t clock;

    while (pwm.channel < N_CHANNELS && channels[pwm.channel].pin != pin)
        pwm.channel++;
    if (pwm.channel >= N_CHANNELS)
        shutdown("Not a valid PWM pin");
    clock = channels[pwm.channel].is_timer2
        ? choose_prescaler(shifts_timer2, sizeof(shifts_timer2), cycle_ticks)
        : choose_prescaler(shifts, sizeof(shifts), cycle_ticks);
    gpio_setup_output(pin, 0);
    control = channels[pwm.channel].control;
    irq_disable();
    if ((control[1] & 7) && (control[1] & 7) != clock)
        shutdown("PWM already programmed at different speed");
    control[0] |= 1;
    control[1] = clock;
    irq_enable();
    pwm_write(pwm, value);
    return pwm;
}

void pwm_write(struct gpio_pwm pwm, uint16_t value)
{
    const ROM struct channel *c = &channels[pwm.channel];
    volatile uint8_t *compare = c->compare;
    irq_flag_t flag = irq_save();

    /* the high byte of a 16 bit register is written first */
    if (c->is_wide)
        compare[1] = 0;
    compare[0] = (uint8_t)(value > PWM_MAX ? PWM_MAX : value);
    c->control[0] |= c->connect;
    irq_restore(flag);
}
