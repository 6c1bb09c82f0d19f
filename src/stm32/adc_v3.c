/* SPDX-License-Identifier: GPL-3.0-or-later
 * The converters of the STM32G4, L4 and H7 (RM0440, 21.4; RM0433, 25.4).
 *
 * The second of two is used for what the first has no channel for; one
 * conversion at a time is under way.
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

/* 247.5 cycles, of an H7 387.5; SMPR holds ten of those fields */
#define SAMPLE_TIMES (6u * 0x9249249u)
#define CONVERSION_TICKS (CONFIG_CLOCK_FREQ / 1000000 * 26)
#define IDLE 0xff

/* HCLK / 4; an H7 has an oscillator of 64 MHz for it, divided by 2 */
#define CCR_CKMODE_4 (3u << 16)
#define CCR_PRESC_2 (1u << 18)
#define CR_BOOST (3u << 8)

/* Bits that do something when they are written */
#define CR_ACTIONS (ADC_CR_ADEN | ADC_CR_ADDIS | ADC_CR_ADSTART \
                    | ADC_CR_ADSTP | ADC_CR_ADCAL)

/* Channel that converts or waits to be read. */
static uint8_t owner = IDLE;

static struct adc_v3_regs *unit_regs(uint8_t unit)
{
    return (struct adc_v3_regs *)(unit ? ADC2_BASE : ADC1_BASE);
}

static void choose_clock(uint8_t unit)
{
    chip_enable(ADC1_GATE);
#if CONFIG_MACH_STM32H7
    RCC->D3CCIPR = RCC_D3CCIPR_ADC_PER;
    if (unit) {
        chip_enable(ADC2_GATE);
        ADC2_COMMON_CCR = CCR_PRESC_2 | ADC_CCR_TSEN;
    } else {
        ADC_COMMON_CCR = CCR_PRESC_2;
    }
#else
    (void)unit;
    ADC_COMMON_CCR = CCR_CKMODE_4 | ADC_CCR_TSEN;
#endif
}

/* Irqs may be on: nobody else uses a converter that is not on yet. */
static void prepare(uint8_t unit)
{
    struct adc_v3_regs *adc = unit_regs(unit);
    uint32_t on = ADC_CR_ADVREGEN | (CONFIG_MACH_STM32H7 ? CR_BOOST : 0);

    choose_clock(unit);
    if (adc->CR & ADC_CR_ADEN)
        return;
    adc->CR = 0;
    adc->CR = on;
    delay_ticks(CONFIG_CLOCK_FREQ / 40000);
    adc->CR = on | ADC_CR_ADCAL;
    while (adc->CR & ADC_CR_ADCAL)
        ;
    delay_ticks(256);
    adc->ISR = ADC_ISR_ADRDY;
    adc->CR = on | ADC_CR_ADEN;
    while (!(adc->ISR & ADC_ISR_ADRDY))
        ;
    adc->SMPR[0] = adc->SMPR[1] = SAMPLE_TIMES;
    adc->CFGR = ADC_CFGR_JQDIS;
}

struct gpio_adc adc_setup(uint32_t pin)
{
    struct gpio_adc adc = adc_find(pin);

    if (adc.channel == ADC_NO_CHANNEL)
        shutdown("Not a valid ADC pin");
    prepare(adc.unit);
#if CONFIG_MACH_STM32H7
    unit_regs(adc.unit)->PCSEL |= 1u << adc.channel;
#endif
    if (pin != PIN_ADC_TEMPERATURE)
        gpio_analog(pin);
    return adc;
}

static uint8_t as_owner(struct gpio_adc adc)
{
    return (uint8_t)(adc.channel | adc.unit << 5);
}

/* Irqs off, or in an interrupt. */
static void act(struct adc_v3_regs *adc, uint32_t action)
{
    adc->CR = (adc->CR & ~CR_ACTIONS) | action;
}

uint32_t adc_sample(struct gpio_adc adc)
{
    struct adc_v3_regs *regs = unit_regs(adc.unit);

    if (owner == as_owner(adc))
        return regs->ISR & ADC_ISR_EOC ? 0 : CONVERSION_TICKS / 4;
    if (owner != IDLE || regs->CR & ADC_CR_ADSTP)
        return CONVERSION_TICKS;
    owner = as_owner(adc);
    regs->SQR[0] = (uint32_t)adc.channel << 6;
    regs->ISR = ADC_ISR_EOC;
    act(regs, ADC_CR_ADSTART);
    return CONVERSION_TICKS;
}

/* Converters of an H7 have 16 bits; the third of an H723 has 12. */
uint16_t adc_read(struct gpio_adc adc)
{
    uint32_t value = unit_regs(adc.unit)->DR;

    owner = IDLE;
    if (CONFIG_MACH_STM32H7 && !(CONFIG_MACH_STM32H723 && adc.unit))
        value >>= 4;
    return (uint16_t)value;
}

void adc_cancel(struct gpio_adc adc)
{
    irq_flag_t flag = irq_save();

    if (owner == as_owner(adc)) {
        if (unit_regs(adc.unit)->CR & ADC_CR_ADSTART)
            act(unit_regs(adc.unit), ADC_CR_ADSTP);
        owner = IDLE;
    }
    irq_restore(flag);
}
