/* SPDX-License-Identifier: GPL-3.0-or-later
 * The converter of the STM32F0 and G0 (RM0091, 13.4; RM0444, 15.3).
 *
 * Each conversion samples for the longest time there is, as in adc_v1.c.
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

#define REGS ((struct adc_v2_regs *)ADC1_BASE)
#define SAMPLE_LONGEST 7
/* About 21 us */
#define CONVERSION_TICKS (CONFIG_CLOCK_FREQ / 1000000 * 22)
#define IDLE 0xff

/* Channel that converts or waits to be read. */
static uint8_t owner = IDLE;

/* At PCLK / 4; the regulator, where there is one, needs 20 us. */
static void prepare(void)
{
    chip_enable(ADC1_GATE);
    if (REGS->CR & ADC_CR_ADEN)
        return;
    REGS->CFGR2 = ADC_V2_CFGR2_PCLK4;
    if (CONFIG_MACH_STM32G0) {
        REGS->CR = ADC_CR_ADVREGEN;
        delay_ticks(CONFIG_CLOCK_FREQ / 40000);
    }
    REGS->CR |= ADC_CR_ADCAL;
    while (REGS->CR & ADC_CR_ADCAL)
        ;
    delay_ticks(32);
    REGS->ISR = ADC_ISR_ADRDY;
    REGS->CR |= ADC_CR_ADEN;
    while (!(REGS->ISR & ADC_ISR_ADRDY))
        ;
    REGS->SMPR = SAMPLE_LONGEST;
    ADC_COMMON_CCR = ADC_CCR_TSEN;
}

struct gpio_adc adc_setup(uint32_t pin)
{
    struct gpio_adc adc = adc_find(pin);

    if (adc.channel == ADC_NO_CHANNEL)
        shutdown("Not a valid ADC pin");
    prepare();
    if (pin != PIN_ADC_TEMPERATURE)
        gpio_analog(pin);
    return adc;
}

/* A channel that was chosen just now is taken a few cycles later. */
static void choose(uint8_t channel)
{
    REGS->CHSELR = 1u << channel;
    if (!CONFIG_MACH_STM32G0)
        return;
    while (!(REGS->ISR & ADC_ISR_CCRDY))
        ;
    REGS->ISR = ADC_ISR_CCRDY;
}

uint32_t adc_sample(struct gpio_adc adc)
{
    if (owner == adc.channel)
        return REGS->ISR & ADC_ISR_EOC ? 0 : CONVERSION_TICKS / 4;
    if (owner != IDLE || REGS->CR & ADC_CR_ADSTP)
        return CONVERSION_TICKS;
    owner = adc.channel;
    if (REGS->CHSELR != 1u << adc.channel)
        choose(adc.channel);
    REGS->ISR = ADC_ISR_EOC;
    REGS->CR |= ADC_CR_ADSTART;
    return CONVERSION_TICKS;
}

uint16_t adc_read(struct gpio_adc adc)
{
    (void)adc;
    owner = IDLE;
    return (uint16_t)REGS->DR;
}

void adc_cancel(struct gpio_adc adc)
{
    irq_flag_t flag = irq_save();

    if (owner == adc.channel) {
        if (REGS->CR & ADC_CR_ADSTART)
            REGS->CR |= ADC_CR_ADSTP;
        owner = IDLE;
    }
    irq_restore(flag);
}
