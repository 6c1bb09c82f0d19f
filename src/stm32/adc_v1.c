/* SPDX-License-Identifier: GPL-3.0-or-later
 * The converter of the STM32F1, F2, F4 and F7 (RM0008, 11.3; RM0090, 13.3).
 *
 * Each conversion samples for the longest time there is: high resistances,
 * like that of the temperature sensor inside, need it, and nobody is in a
 * hurry.
 */
#include "adc_pins.h"
#include "board/adc.h"
#include "board/delay.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"

#define ADC_MAX 4095
DECL_CONSTANT("ADC_MAX", ADC_MAX);
DECL_ENUMERATION("pin", "ADC_TEMPERATURE", 0xfe);

/* About 23 us; the wait for another pin */
#define CONVERSION_TICKS (CONFIG_CLOCK_FREQ / 1000000 * 24)
#define IDLE 0xff

/* Channel that converts or waits to be read. */
static uint8_t owner = IDLE;

static struct adc_v1_regs *unit_regs(uint8_t unit)
{
    (void)unit;
#ifdef ADC3_BASE
    if (unit)
        return (struct adc_v1_regs *)ADC3_BASE;
#endif
    return (struct adc_v1_regs *)ADC1_BASE;
}

#if CONFIG_MACH_STM32F1
#define START (ADC_V1_CR2_ADON | ADC_F1_CR2_EXTTRIG | ADC_F1_CR2_EXTSEL_SW \
               | ADC_F1_CR2_TSVREFE | ADC_F1_CR2_SWSTART)

static void prepare(uint8_t unit)
{
    struct adc_v1_regs *adc = unit_regs(unit);

    chip_enable(ADC1_GATE);
    if (adc->CR2 & ADC_V1_CR2_ADON)
        return;
    adc->CR2 = ADC_V1_CR2_ADON;
    delay_ticks(CONFIG_CLOCK_FREQ / 500000);
    adc->CR2 = ADC_V1_CR2_ADON | ADC_F1_CR2_CAL;
    while (adc->CR2 & ADC_F1_CR2_CAL)
        ;
    adc->CR2 = START & ~ADC_F1_CR2_SWSTART;
}
#else
#define START (ADC_V1_CR2_ADON | ADC_F4_CR2_SWSTART)

static void prepare(uint8_t unit)
{
    chip_enable(ADC1_GATE);
#ifdef ADC3_GATE
    if (unit)
        chip_enable(ADC3_GATE);
#endif
    ADC_COMMON_CCR = ADC_CCR_ADCPRE_4 | ADC_CCR_TSVREFE;
    unit_regs(unit)->CR2 = ADC_V1_CR2_ADON;
}
#endif

struct gpio_adc adc_setup(uint32_t pin)
{
    struct gpio_adc adc = adc_find(pin);

    if (adc.channel == ADC_NO_CHANNEL)
        shutdown("Not a valid ADC pin");
    prepare(adc.unit);
    unit_regs(adc.unit)->SMPR[0] = unit_regs(adc.unit)->SMPR[1] = 0x3fffffff;
    if (pin != PIN_ADC_TEMPERATURE)
        gpio_analog(pin);
    return adc;
}

static uint8_t as_owner(struct gpio_adc adc)
{
    return (uint8_t)(adc.channel | adc.unit << 5);
}

uint32_t adc_sample(struct gpio_adc adc)
{
    struct adc_v1_regs *regs = unit_regs(adc.unit);

    if (owner == as_owner(adc))
        return regs->SR & ADC_V1_SR_EOC ? 0 : CONVERSION_TICKS / 4;
    if (owner != IDLE)
        return CONVERSION_TICKS;
    owner = as_owner(adc);
    regs->SQR[2] = adc.channel;
    regs->SR = 0;
    regs->CR2 = START;
    return CONVERSION_TICKS;
}

uint16_t adc_read(struct gpio_adc adc)
{
    owner = IDLE;
    return (uint16_t)unit_regs(adc.unit)->DR;
}

/* What still converts is restarted by the next one; its flag is awaited. */
void adc_cancel(struct gpio_adc adc)
{
    irq_flag_t flag = irq_save();

    if (owner == as_owner(adc))
        owner = IDLE;
    irq_restore(flag);
}
