/* SPDX-License-Identifier: GPL-3.0-or-later
 * Converters: 12 bits of the supply voltage (data sheets, ADC).
 *
 * 1.5 MHz, 32 cycles of sampling and 7 to 12 of converting.
 */
#include "board/adc.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"
#include "adc_pins.h"

DECL_CONSTANT("ADC_MAX", 4095);
/* VREFA: boards may tie it to their reference */
DECL_CONSTANT_STR("RESERVE_PINS_adc", "PA3");
#ifdef ADC_INPUT_TEMPERATURE
DECL_ENUMERATION("pin", "ADC_TEMPERATURE", PIN_ADC_TEMPERATURE);
#endif
#ifdef ADC_INPUT_TEMPERATURE_CTAT
/* the second sensor, whose voltage falls */
DECL_ENUMERATION("pin", "ADC_TEMPERATURE_CTAT", PIN_ADC_TEMPERATURE_CTAT);
#endif

#define UNIT0 ((struct adc_regs *)ADC0_BASE)
#define CONVERSION_TICKS (CONFIG_CLOCK_FREQ / 1000000 * 33)
#define SAMPLE_CYCLES (32 * 2 - 1)  /* half ones, less one */
#define CTRLA_ENABLE 2
#define INT_RESRDY 1
#define SWTRIG_FLUSH 1
#define SWTRIG_START 2
#define IDLE 0xff

/* Channel that converts or waits to be read, of one converter or the other */
static uint8_t owner = IDLE;
static struct adc_regs *owner_regs;

#if CONFIG_MACH_SAMD21
static void sync(struct adc_regs *regs)
{
    while (regs->STATUS & ADC_STATUS_SYNCBUSY)
        ;
}

static void prepare(struct adc_regs *regs)
{
    chip_enable(ADC0_GATE);
    chip_feed(CHANNEL_ADC0, GEN_PERIPHERALS);
    if (regs->CTRLA & CTRLA_ENABLE)
        return;
    regs->CALIB = (uint16_t)NVM_ADC_CALIB;
    /* half of the supply, and half of the input */
    regs->REFCTRL = ADC_REFCTRL_HALF_VCC;
    regs->CTRLB = ADC_CTRLB_DIV_32;
    sync(regs);
    regs->SAMPCTRL = SAMPLE_CYCLES;
    SYSCTRL_VREF |= SYSCTRL_VREF_TSEN;
    regs->CTRLA = CTRLA_ENABLE;
    sync(regs);
}

static void choose(struct adc_regs *regs, uint8_t channel)
{
    regs->INPUTCTRL = channel | ADC_INPUT_GROUND | ADC_INPUT_GAIN_HALF;
    sync(regs);
}
#else
static void sync(struct adc_regs *regs)
{
    while (regs->SYNCBUSY)
        ;
}

static void prepare(struct adc_regs *regs)
{
    chip_enable(ADC0_GATE);
    chip_feed(CHANNEL_ADC0, GEN_PERIPHERALS);
#if CONFIG_MACH_SAMX5
    chip_enable(ADC1_GATE);
    chip_feed(CHANNEL_ADC1, GEN_PERIPHERALS);
    if (regs->CTRLA & CTRLA_ENABLE)
        return;
    regs->CALIB = (uint16_t)(regs == UNIT0 ? NVM_ADC0_CALIB : NVM_ADC1_CALIB);
    /* on demand: the channel says which of the two sensors */
    SUPC_VREF |= SUPC_VREF_TSEN | SUPC_VREF_ONDEMAND;
    regs->CTRLA = 4u << 8; /* by 32 */
#else
    if (regs->CTRLA & CTRLA_ENABLE)
        return;
    regs->CALIB = NVM_ADC_CALIB;
    regs->CTRLB = 4; /* by 32 */
#endif
    regs->REFCTRL = ADC_REFCTRL_VCC;
    regs->SAMPCTRL = SAMPLE_CYCLES;
    sync(regs);
    regs->CTRLA |= CTRLA_ENABLE;
    sync(regs);
}

static void choose(struct adc_regs *regs, uint8_t channel)
{
    regs->INPUTCTRL = (uint16_t)(channel | ADC_INPUT_GROUND);
    sync(regs);
}
#endif

static bool find_channel(const uint8_t *pins, uint32_t n_pins, uint32_t pin,
                         uint8_t *channel)
{
    uint8_t i;

    for (i = 0; i < n_pins; i++)
        if (pins[i] == pin) {
            *channel = i;
            return true;
        }
    return false;
}

static struct gpio_adc find_input(uint32_t pin)
{
    struct gpio_adc adc = { UNIT0, 0 };

    if (find_channel(unit0_pins, sizeof(unit0_pins), pin, &adc.channel))
        return adc;
#if CONFIG_MACH_SAMX5
    adc.regs = (struct adc_regs *)ADC1_BASE;
    if (find_channel(unit1_pins, sizeof(unit1_pins), pin, &adc.channel))
        return adc;
    adc.regs = UNIT0;
#endif
#ifdef ADC_INPUT_TEMPERATURE
    adc.channel = ADC_INPUT_TEMPERATURE;
    if (pin == PIN_ADC_TEMPERATURE)
        return adc;
#endif
#ifdef ADC_INPUT_TEMPERATURE_CTAT
    adc.channel = ADC_INPUT_TEMPERATURE_CTAT;
    if (pin == PIN_ADC_TEMPERATURE_CTAT)
        return adc;
#endif
    shutdown("Not a valid ADC pin");
}

struct gpio_adc adc_setup(uint32_t pin)
{
    struct gpio_adc adc = find_input(pin);

    prepare(adc.regs);
    if (pin != PIN_ADC_TEMPERATURE && pin != PIN_ADC_TEMPERATURE_CTAT)
        gpio_mux(pin, MUX_B, 0);
    return adc;
}

uint32_t adc_sample(struct gpio_adc adc)
{
    if (owner == adc.channel && owner_regs == adc.regs)
        return adc.regs->INTFLAG & INT_RESRDY ? 0 : CONVERSION_TICKS / 8;
    if (owner != IDLE)
        return CONVERSION_TICKS;
    owner = adc.channel;
    owner_regs = adc.regs;
    choose(adc.regs, adc.channel);
    adc.regs->INTFLAG = INT_RESRDY;
    adc.regs->SWTRIG = SWTRIG_START;
    return CONVERSION_TICKS;
}

uint16_t adc_read(struct gpio_adc adc)
{
    owner = IDLE;
    return adc.regs->RESULT;
}

void adc_cancel(struct gpio_adc adc)
{
    irq_flag_t flag = irq_save();

    if (owner == adc.channel && owner_regs == adc.regs) {
        adc.regs->SWTRIG = SWTRIG_FLUSH;
        sync(adc.regs);
        owner = IDLE;
    }
    irq_restore(flag);
}
