/* SPDX-License-Identifier: GPL-3.0-or-later
 * The converter: 2 us each (data sheet, 4.9). */
#include "board/adc.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"

DECL_CONSTANT("ADC_MAX", 4095);
DECL_ENUMERATION("pin", "ADC_TEMPERATURE", 0xfe);

#define REGS ((struct adc_regs *)ADC_BASE)
#define CS_ON (ADC_CS_EN | ADC_CS_TS_EN)
/* 96 cycles of 48 MHz */
#define CONVERSION_TICKS (CONFIG_CLOCK_FREQ / 1000000 * 3)
#define IDLE 0xff

/* Channel that converts or waits to be read. */
static uint8_t owner = IDLE;

struct gpio_adc adc_setup(uint32_t pin)
{
    struct gpio_adc adc = { (uint8_t)(pin - ADC_FIRST_PIN) };

    if (pin == PIN_ADC_TEMPERATURE)
        adc.channel = ADC_PINS;
    else if (pin - ADC_FIRST_PIN >= ADC_PINS)
        shutdown("Not a valid ADC pin");
    chip_enable(RESET_ADC);
    REGS->CS = CS_ON;
    while (!(REGS->CS & ADC_CS_READY))
        ;
    if (pin != PIN_ADC_TEMPERATURE)
        gpio_analog(pin);
    return adc;
}

uint32_t adc_sample(struct gpio_adc adc)
{
    uint32_t status = REGS->CS;

    if (owner == adc.channel)
        return status & ADC_CS_READY ? 0 : CONVERSION_TICKS / 3;
    if (owner != IDLE || !(status & ADC_CS_READY))
        return CONVERSION_TICKS;
    owner = adc.channel;
    REGS->CS = CS_ON | ADC_CS_AINSEL(adc.channel) | ADC_CS_START_ONCE;
    return CONVERSION_TICKS;
}

uint16_t adc_read(struct gpio_adc adc)
{
    (void)adc;
    owner = IDLE;
    return (uint16_t)REGS->RESULT;
}

void adc_cancel(struct gpio_adc adc)
{
    irq_flag_t flag = irq_save();

    if (owner == adc.channel)
        owner = IDLE;
    irq_restore(flag);
}
