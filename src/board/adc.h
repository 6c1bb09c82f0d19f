/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contract: analog inputs.  port.h defines struct gpio_adc.
 *
 * The port declares DECL_CONSTANT("ADC_MAX", <full scale reading>).  There is
 * one converter: one sample is under way at a time, others wait for it.
 */
#ifndef BOARD_ADC_H
#define BOARD_ADC_H

#include <stdint.h>
#include "port.h"

/* --- The port provides --- */

/* Task: prepare `pin`; shutdown("Not a valid ADC pin") if it is none. */
struct gpio_adc adc_setup(uint32_t pin);

/* Irq: start or continue a conversion.  Returns 0 when the value is ready
 * for adc_read(), else the ticks after which to ask again (also when another
 * pin occupies the converter).  Never blocks. */
uint32_t adc_sample(struct gpio_adc adc);

/* Irq: the value of a finished conversion, 0..ADC_MAX; frees the converter. */
uint16_t adc_read(struct gpio_adc adc);

/* Any context: give up a conversion of this pin, if one is under way. */
void adc_cancel(struct gpio_adc adc);

#endif
