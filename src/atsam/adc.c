/* SPDX-License-Identifier: GPL-3.0-or-later
 * The converters: ADC of SAM3X and SAM4S (11057, 43.6), two AFEC of SAM4E and
 * SAM E70 (11157, 43.6).
 *
 * One conversion at a time is under way, with one channel on.
 */
#include "board/adc.h"
#include "board/gpio.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"
#include "adc_pins.h"

DECL_CONSTANT("ADC_MAX", 4095);
DECL_ENUMERATION("pin", "ADC_TEMPERATURE", PIN_ADC_TEMPERATURE);

#if CONFIG_ATSAM_AFEC
typedef struct afec_regs converter_t;
#else
typedef struct adc_regs converter_t;
#endif

/* 14 or 15 MHz */
#if CONFIG_MACH_SAM3X
#define PRESCALER 2u                /* 84 MHz / 2 / 3 */
#elif CONFIG_MACH_SAME70
#define PRESCALER 9u                /* 150 MHz / 10 */
#else
#define PRESCALER 3u                /* 120 MHz / 2 / 4 */
#endif
#define MODE (ADC_MR_PRESCAL(PRESCALER) | ADC_MR_STARTUP_512 \
              | ADC_MR_SETTLING_17 | ADC_MR_TRACKTIM_16 \
              | (CONFIG_MACH_SAM3X ? ADC_MR_TRANSFER(1u) \
                 : ADC_MR_TRANSFER(2u)) \
              | (CONFIG_ATSAM_AFEC ? AFEC_MR_ONE : 0))
/* The middle of the range is at this offset */
#define MIDDLE (CONFIG_MACH_SAME70 ? 0x200 : 0x800)

#define CONVERSION_TICKS (CONFIG_CLOCK_FREQ / 1000000 * 4)
#define IDLE 0xff

/* Channel that converts or waits to be read; has something been started? */
static uint8_t owner = IDLE;
static bool is_started[2];

static converter_t *unit_regs(uint8_t unit)
{
#if CONFIG_ATSAM_AFEC
    return (converter_t *)(unit ? AFEC1_BASE : AFEC0_BASE);
#else
    (void)unit;
    return (converter_t *)ADC_BASE;
#endif
}

static bool find_channel(uint32_t pin, struct gpio_adc *adc)
{
    uint8_t i;

    for (i = 0; i < sizeof(unit0_pins); i++)
        if (unit0_pins[i] == pin) {
            *adc = (struct gpio_adc) { i, 0 };
            return true;
        }
#if CONFIG_ATSAM_AFEC
    for (i = 0; i < sizeof(unit1_pins); i++)
        if (unit1_pins[i] == pin) {
            *adc = (struct gpio_adc) { i, 1 };
            return true;
        }
#endif
    return false;
}

/* Task: the mode once, then what the channel needs. */
static void prepare(struct gpio_adc adc)
{
    converter_t *regs = unit_regs(adc.unit);

#if CONFIG_ATSAM_AFEC
    chip_enable(adc.unit ? AFEC1_ID : AFEC0_ID);
#else
    chip_enable(ADC_ID);
#endif
    if (regs->MR != MODE) {
        regs->CR = ADC_CR_SWRST;
        regs->MR = MODE;
    }
#if CONFIG_ATSAM_AFEC
    if (CONFIG_MACH_SAME70)
        regs->ACR |= AFEC_ACR_PGA;
    regs->CSELR = adc.channel;
    regs->COCR = MIDDLE;
#else
    regs->ACR |= ADC_ACR_TSON;
#endif
}

struct gpio_adc adc_setup(uint32_t pin)
{
    struct gpio_adc adc;

    if (!find_channel(pin, &adc))
        shutdown("Not a valid ADC pin");
    prepare(adc);
    if (pin != PIN_ADC_TEMPERATURE)
        gpio_setup_input(pin, 0);
    return adc;
}

static uint8_t as_owner(struct gpio_adc adc)
{
    return (uint8_t)(adc.channel | adc.unit << 5);
}

/* What was cancelled must end before another channel may begin. */
static bool is_free(uint8_t unit)
{
    converter_t *regs = unit_regs(unit);

    if (!is_started[unit])
        return true;
    if (!(regs->ISR & ADC_ISR_DRDY))
        return false;
    (void)regs->LCDR;
    is_started[unit] = false;
    return true;
}

uint32_t adc_sample(struct gpio_adc adc)
{
    converter_t *regs = unit_regs(adc.unit);

    if (owner == as_owner(adc))
        return regs->ISR & ADC_ISR_DRDY ? 0 : CONVERSION_TICKS / 4;
    if (owner != IDLE || !is_free(adc.unit))
        return CONVERSION_TICKS;
    owner = as_owner(adc);
    regs->CHDR = 0xffff;
    regs->CHER = 1u << adc.channel;
    is_started[adc.unit] = true;
    regs->CR = ADC_CR_START;
    return CONVERSION_TICKS;
}

uint16_t adc_read(struct gpio_adc adc)
{
    owner = IDLE;
    is_started[adc.unit] = false;
    return unit_regs(adc.unit)->LCDR & 0xfff;
}

void adc_cancel(struct gpio_adc adc)
{
    irq_flag_t flag = irq_save();

    if (owner == as_owner(adc))
        owner = IDLE;
    irq_restore(flag);
}
