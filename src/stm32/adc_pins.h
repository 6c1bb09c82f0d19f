/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which channel of which converter a pin has.
 */
#ifndef STM32_ADC_PINS_H
#define STM32_ADC_PINS_H

#include "port.h"

#define ADC_NO_CHANNEL 0xff

/* .channel is ADC_NO_CHANNEL if the pin has none. */
struct gpio_adc adc_find(uint32_t pin);

#endif
