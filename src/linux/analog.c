/* SPDX-License-Identifier: GPL-3.0-or-later
 * Analog inputs. */
#include "board/adc.h"
#include "core/sched.h"
#include "devices.h"
#include "pins.h"

#define ADC_MAX 4095

DECL_CONSTANT("ADC_MAX", ADC_MAX);
DECL_ENUMERATION_RANGE("pin", "analog0", PINS_ANALOG, PINS_ANALOG_INPUTS);

struct adc_input {
    int handle;
    bool is_open;
};

static struct adc_input inputs[PINS_ANALOG_INPUTS];

struct gpio_adc adc_setup(uint32_t pin)
{
    struct adc_input *input;

    if (pin < PINS_ANALOG || pin >= PINS_ANALOG + PINS_ANALOG_INPUTS)
        shutdown("Not a valid ADC pin");
    input = &inputs[pin - PINS_ANALOG];
    if (!input->is_open)
        input->handle = devices.adc->open(pin - PINS_ANALOG);
    input->is_open = input->handle >= 0;
    if (!input->is_open)
        shutdown("Not a valid ADC pin");
    return (struct gpio_adc){ input };
}

uint32_t adc_sample(struct gpio_adc adc)
{
    return devices.adc->sample(adc.input->handle);
}

uint16_t adc_read(struct gpio_adc adc)
{
    int value = devices.adc->read(adc.input->handle);

    if (value < 0)
        try_shutdown("Analog input cannot be read");
    if (value < 0)
        return 0;
    return (uint16_t)(value < ADC_MAX ? value : ADC_MAX);
}

void adc_cancel(struct gpio_adc adc)
{
    devices.adc->cancel(adc.input->handle);
}
