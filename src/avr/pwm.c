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

#define WIDE(PIN, N, X) \
    { PIN, &OCR##N##X##L, &TCCR##N##A, 1 << COM##N##X##1, 0, 1 }

static const ROM struct channel channels[] = {
#if CONFIG_MACH_atmega2560
    { 15, &OCR0A, &TCCR0A, 1 << COM0A1, 0, 0 },
    { 53, &OCR0B, &TCCR0A, 1 << COM0B1, 0, 0 },
    { 12, &OCR2A, &TCCR2A, 1 << COM2A1, 1, 0 },
    { 62, &OCR2B, &TCCR2A, 1 << COM2B1, 1, 0 },
    WIDE(35, 3, A), WIDE(36, 3, B), WIDE(37, 3, C),
    WIDE(59, 4, A), WIDE(60, 4, B), WIDE(61, 4, C),
    WIDE(91, 5, A), WIDE(92, 5, B), WIDE(93, 5, C),
#else
    { 11, &OCR0A, &TCCR0A, 1 << COM0A1, 0, 0 },
    { 12, &OCR0B, &TCCR0A, 1 << COM0B1, 0, 0 },
    { 31, &OCR2A, &TCCR2A, 1 << COM2A1, 1, 0 },
    { 30, &OCR2B, &TCCR2A, 1 << COM2B1, 1, 0 },
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
