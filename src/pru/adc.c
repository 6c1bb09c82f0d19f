/* SPDX-License-Identifier: GPL-3.0-or-later
 * PRU1: analog inputs, which PRU0 reads (analog.c). */
#include "board/adc.h"
#include "board/timer.h"
#include "core/sched.h"
#include "exec.h"

DECL_CONSTANT("ADC_MAX", 4095);
DECL_ENUMERATION_RANGE("pin", "AIN0", 128, 8);

enum { FIRST_PIN = 128, RETRY_TICKS = 100 * (CONFIG_CLOCK_FREQ / 1000000) };

struct gpio_adc adc_setup(uint32_t pin)
{
    pin -= FIRST_PIN;
    if (pin >= MAILBOX_ANALOG)
        shutdown("Not a valid ADC pin");
    BOX->analog_wanted = 1;
    BOX->analog[pin] = MAILBOX_NO_READING;
    return (struct gpio_adc) { (uint8_t)pin };
}

uint32_t adc_sample(struct gpio_adc adc)
{
    return BOX->analog[adc.input] == MAILBOX_NO_READING ? RETRY_TICKS : 0;
}

/* Each reading is used once: it is not older than the use before. */
uint16_t adc_read(struct gpio_adc adc)
{
    uint16_t value = BOX->analog[adc.input];

    BOX->analog[adc.input] = MAILBOX_NO_READING;
    return value;
}

void adc_cancel(struct gpio_adc adc)
{
    BOX->analog[adc.input] = MAILBOX_NO_READING;
}
