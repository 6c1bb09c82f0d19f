/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Peripherals of an STM32: GPIO, USART, ADC, timers' pwm, watchdog.
 */
#include <string.h>

#include "unicorn_chip.h"

#define PERIPH_BASE 0x40000000u
#define PERIPH_SIZE 0x20000000u
#define LSI_HZ 32000

/* Words of the registers */
enum { V2_MODER = 0, V2_PUPDR = 3, V2_IDR = 4, V2_ODR = 5, V2_BSRR = 6,
       V2_BRR = 10, V1_IDR = 2, V1_ODR = 3, V1_BSRR = 4, V1_BRR = 5 };
enum { SR_ORE = 1 << 3, SR_RXNE = 1 << 5, SR_TC = 1 << 6, SR_TXE = 1 << 7,
       CR1_RXNEIE = 1 << 5, CR1_TXEIE = 1 << 7 };

/*
 * GPIO
 */

/* What a pin is set to: 0 input, 1 output, 2 alternate, 3 analog; and the
 * pull of an input. */
static uint32_t
pin_mode(const struct device *d, uint32_t bit, int8_t *pull)
{
    uint32_t nibble, pupd;

    if (chip.model->gpio_v2) {
        pupd = (d->regs[V2_PUPDR] >> (2 * bit)) & 3;
        *pull = pupd == 1 ? 1 : pupd == 2 ? -1 : 0;
        return (d->regs[V2_MODER] >> (2 * bit)) & 3;
    }
    nibble = (d->regs[bit / 8] >> (4 * (bit % 8))) & 15;
    *pull = nibble != 8 ? 0 : d->regs[V1_ODR] & (1u << bit) ? 1 : -1;
    if (nibble & 3)
        return nibble & 8 ? 2 : 1;
    return nibble ? 0 : 3;
}

static struct device *
find_kind(enum device_kind kind, uint8_t index)
{
    uint32_t i;

    for (i = 0; i < chip.n_devices; i++)
        if (chip.devices[i].info->kind == kind
            && chip.devices[i].info->index == index)
            return &chip.devices[i];
    return NULL;
}

/* Is this pin driven by its timer's channel? */
static bool
is_pwm_on(const struct pwm_info *pwm, const struct device *timer)
{
    const struct device *port = find_kind(DEV_GPIO, pwm->pin / 16);
    uint32_t bit = pwm->pin % 16, channel = pwm->channel;
    int8_t pull;

    if (!port || !timer || pin_mode(port, bit, &pull) != 2)
        return false;
    if (chip.model->gpio_v2
        && ((port->regs[8 + bit / 8] >> (4 * (bit % 8))) & 15) != pwm->function)
        return false;
    /* CEN, CCxE, OCxM of pwm mode 1; MOE of those with a break input */
    if (timer->info->index >= 15 && !(timer->regs[17] & (1u << 15)))
        return false;
    return timer->regs[0] & 1 && timer->regs[8] & (1u << (4 * channel))
        && ((timer->regs[6 + channel / 2] >> (8 * (channel % 2))) & 0x70)
        == 0x60;
}

/* Registers of a timer or a pin have changed. */
static void
update_pwm(void)
{
    const struct pwm_info *pwm = chip.model->pwm;
    uint32_t i;

    for (i = 0; pwm[i].timer; i++) {
        const struct device *timer = find_kind(DEV_TIM, pwm[i].timer);
        uint32_t *told = chip.pwm_told[i], now[3], hz;

        if (!is_pwm_on(&pwm[i], timer))
            continue;
        hz = chip.bus_hz[timer->info->bus];
        now[0] = (timer->regs[10] + 1) * (timer->regs[11] + 1)
            * (chip.core_hz / (hz < chip.core_hz ? 2 * hz : hz));
        now[1] = timer->regs[13 + pwm[i].channel];
        now[2] = timer->regs[11] + 1;
        if (!memcmp(told, now, sizeof(now)))
            continue;
        memcpy(told, now, sizeof(now));
        chip.host.pwm_out(chip.host.ctx, chip_now(), pwm[i].pin, now[0], now[1],
                          now[2]);
    }
}

/* Tell the world what outputs have changed. */
static void
update_outputs(struct device *d)
{
    uint32_t odr = d->regs[chip.model->gpio_v2 ? V2_ODR : V1_ODR], bit;
    uint32_t changed = (d->out ^ odr) & d->driven;

    d->out = (d->out & ~d->driven) | (odr & d->driven);
    while (changed) {
        bit = (uint32_t)__builtin_ctz(changed);
        changed &= changed - 1;
        chip.host.pin_out(chip.host.ctx, chip_now(), d->info->index * 16 + bit,
                          (odr >> bit) & 1);
    }
}

/* Modes have changed: what is an output now shows its level. */
static void
update_modes(struct device *d)
{
    uint32_t odr = d->regs[chip.model->gpio_v2 ? V2_ODR : V1_ODR], bit;
    uint32_t was = d->driven;
    int8_t pull;

    d->driven = 0;
    for (bit = 0; bit < 16; bit++)
        if (pin_mode(d, bit, &pull) == 1)
            d->driven |= 1u << bit;
    /* a pin that begins to be driven had no level before */
    d->out = (d->out & was) | (~odr & d->driven & ~was);
    update_outputs(d);
    update_pwm();
}

static uint32_t
read_inputs(struct device *d)
{
    uint32_t bit, idr = 0;

    for (bit = 0; bit < 16; bit++) {
        int8_t pull;
        uint32_t mode = pin_mode(d, bit, &pull);

        if (mode == 1)
            idr |= d->out & (1u << bit);
        else if (mode == 0 && chip.host.pin_in(
                     chip.host.ctx, chip_now(), d->info->index * 16 + bit,
                     pull))
            idr |= 1u << bit;
    }
    return idr;
}

static uint32_t
gpio_read(struct device *d, uint32_t word)
{
    if (word == (chip.model->gpio_v2 ? V2_IDR : V1_IDR))
        return read_inputs(d);
    return d->regs[word];
}

static void
gpio_write(struct device *d, uint32_t word, uint32_t value)
{
    uint32_t *odr = &d->regs[chip.model->gpio_v2 ? V2_ODR : V1_ODR];

    if (word == (chip.model->gpio_v2 ? V2_BSRR : V1_BSRR)) {
        *odr = ((*odr & ~(value >> 16)) | value) & 0xffff;
    } else if (word == (chip.model->gpio_v2 ? V2_BRR : V1_BRR)) {
        *odr &= ~value;
    } else if (odr == &d->regs[word]) {
        *odr = value & 0xffff;
    } else {
        d->regs[word] = value;
        update_modes(d);
        return;
    }
    update_outputs(d);
}

/*
 * USART.  regs[] holds: 0 status, 1 control, 2 divider.
 */

/* Word of the chip's register: its purpose */
enum usart_word { USART_STATUS, USART_CR1, USART_BRR, USART_RDR, USART_TDR,
                  USART_ICR, USART_OTHER };

static enum usart_word
usart_word(uint32_t word)
{
    static const uint8_t v1[] = { USART_STATUS, USART_RDR, USART_BRR, USART_CR1,
                                  USART_OTHER, USART_OTHER, USART_OTHER };
    static const uint8_t v2[] = { USART_CR1, USART_OTHER, USART_OTHER, USART_BRR,
                                  USART_OTHER, USART_OTHER, USART_OTHER,
                                  USART_STATUS, USART_ICR, USART_RDR,
                                  USART_TDR };

    if (chip.model->usart_v2)
        return word < sizeof(v2) ? v2[word] : USART_OTHER;
    return word < sizeof(v1) ? v1[word] : USART_OTHER;
}

static void
update_usart_irq(struct device *d)
{
    bool rx = d->regs[0] & (SR_RXNE | SR_ORE) && d->regs[1] & CR1_RXNEIE;
    bool tx = d->regs[0] & SR_TXE && d->regs[1] & CR1_TXEIE;

    core_set_pending(16u + d->info->irq, rx || tx);
}

/* Cycles of the core that a byte takes; 0 if the baud rate is wrong. */
static uint64_t
usart_byte_cycles(const struct device *d)
{
    uint32_t enable = chip.model->usart_v2 ? 1u : 1u << 13;
    uint32_t bus = chip.bus_hz[d->info->bus], brr = d->regs[2];
    double baud;

    if (!brr || !(d->regs[1] & enable))
        return 0;
    baud = (double)bus / brr;
    if (baud < chip.baud * .97 || baud > chip.baud * 1.03) {
        chip_fault("usart at %.0f baud instead of %u", baud, chip.baud);
        return 0;
    }
    return (uint64_t)(10. * chip.core_hz / baud);
}

static void
start_tx(struct device *d)
{
    if (!d->has_tdr || d->due != NEVER)
        return;
    d->shift = d->regs[3];
    d->has_tdr = false;
    d->regs[0] |= SR_TXE;
    d->due = chip.cycle + usart_byte_cycles(d);
    chip_wake_at(d->due);
}

static void
usart_event(struct device *d)
{
    uint8_t byte = (uint8_t)d->shift;

    if (chip.cycle < d->due)
        return;
    d->due = NEVER;
    chip.host.tx(chip.host.ctx, chip_now(), &byte, 1);
    start_tx(d);
    update_usart_irq(d);
}

static void
usart_write(struct device *d, uint32_t word, uint32_t value)
{
    switch (usart_word(word)) {
    case USART_CR1:
        d->regs[1] = value;
        chip.console = d;
        break;
    case USART_BRR:
        d->regs[2] = value;
        break;
    case USART_RDR:             /* DR of the first version */
    case USART_TDR:
        d->regs[3] = value;
        d->regs[0] &= ~(uint32_t)SR_TXE;
        d->has_tdr = true;
        start_tx(d);
        break;
    case USART_ICR:
        d->regs[0] &= ~(value & SR_ORE);
        break;
    default:
        break;
    }
    update_usart_irq(d);
}

static uint32_t
usart_read(struct device *d, uint32_t word)
{
    switch (usart_word(word)) {
    case USART_STATUS:
        return d->regs[0];
    case USART_CR1:
        return d->regs[1];
    case USART_BRR:
        return d->regs[2];
    case USART_RDR:
        d->regs[0] &= ~(uint32_t)SR_RXNE;
        if (!chip.model->usart_v2)
            d->regs[0] &= ~(uint32_t)SR_ORE;
        update_usart_irq(d);
        return d->rx_data;
    default:
        return 0;
    }
}

bool
periph_rx_busy(void)
{
    return !chip.console || chip.cycle < chip.console->next_rx;
}

void
periph_rx(uint8_t byte)
{
    struct device *d = chip.console;
    uint64_t cycles = usart_byte_cycles(d);

    if (!cycles)
        return;
    d->next_rx = chip.cycle + cycles;
    if (d->regs[0] & SR_RXNE) {
        d->regs[0] |= SR_ORE;
    } else {
        d->rx_data = byte;
        d->regs[0] |= SR_RXNE;
    }
    update_usart_irq(d);
}

/*
 * ADC of the F1, F2, F4 and F7
 */

enum { ADC2_ISR = 0, ADC2_CR = 2, ADC2_CFGR2 = 4, ADC2_SMPR = 5,
       ADC2_CHSELR = 10, ADC2_DR = 16 };
enum { ADC2_ADRDY = 1, ADC2_EOC = 4, ADC2_CCRDY = 1 << 13, ADC2_ADEN = 1,
       ADC2_ADSTART = 4, ADC2_ADSTP = 16 };
enum { ADC_SR = 0, ADC_CR2 = 2, ADC_SQR3 = 13, ADC_DR = 19 };

static void
adc_start(struct device *d)
{
    static const uint16_t f1[] = { 1, 7, 13, 28, 41, 55, 71, 239 };
    static const uint16_t f4[] = { 3, 15, 28, 56, 84, 112, 144, 480 };
    bool is_f1 = chip.model->line == LINE_F1;
    uint32_t channel = d->regs[ADC_SQR3] & 31;
    uint32_t smpr = d->regs[channel >= 10 ? 3 : 4];
    uint32_t sample = (smpr >> (3 * (channel % 10))) & 7, divider;

    divider = is_f1 ? 2 * ((chip.rcc->regs[1] >> 14) & 3) + 2 : 4;
    if (chip.bus_hz[2] / divider > (is_f1 ? 14000000u : 36000000u))
        chip_fault("converter at %u Hz", chip.bus_hz[2] / divider);
    d->due = chip.cycle + ((is_f1 ? f1 : f4)[sample] + 13u) * divider
        * (chip.core_hz / chip.bus_hz[2]);
    d->shift = channel;
    chip_wake_at(d->due);
}

static void
adc_event(struct device *d)
{
    int pin = chip.model->adc_pin(d->info->index, (uint8_t)d->shift);
    uint32_t value;

    if (chip.cycle < d->due)
        return;
    d->due = NEVER;
    value = pin < 0 ? 0
        : chip.host.adc_in(chip.host.ctx, chip_now(), (uint32_t)pin);
    /* 12 bits, of an H7 16 */
    if (chip.model->line != LINE_H7)
        value >>= 4;
    if (chip.model->adc_version == 1) {
        d->regs[ADC_SR] |= 2;
        d->regs[ADC_DR] = value;
    } else {
        d->regs[ADC2_CR] &= ~(uint32_t)ADC2_ADSTART;
        d->regs[ADC2_ISR] |= ADC2_EOC;
        d->regs[ADC2_DR] = value;
    }
}

static void
adc_write(struct device *d, uint32_t word, uint32_t value)
{
    bool is_f1 = chip.model->line == LINE_F1;

    if (word == ADC_SR) {
        d->regs[ADC_SR] &= value;
        return;
    }
    if (word == ADC_CR2) {
        bool was_on = d->regs[ADC_CR2] & 1;

        /* calibration ends at once, a start is no state */
        d->regs[ADC_CR2] = value & ~(is_f1 ? 1u << 2 | 1u << 22 : 1u << 30);
        if (was_on && value & (is_f1 ? 1u << 22 : 1u << 30))
            adc_start(d);
        return;
    }
    d->regs[word] = value;
}

static uint32_t
adc_read(struct device *d, uint32_t word)
{
    if (word == ADC_DR)
        d->regs[ADC_SR] &= ~2u;
    return d->regs[word];
}

/*
 * ADC of the F0 and G0
 */

static void
adc2_start(struct device *d)
{
    static const uint16_t f0[] = { 1, 7, 13, 28, 41, 55, 71, 239 };
    static const uint16_t g0[] = { 1, 3, 7, 12, 19, 39, 79, 160 };
    bool is_f0 = chip.model->line == LINE_F0;
    uint32_t sample = (is_f0 ? f0 : g0)[d->regs[ADC2_SMPR] & 7];
    uint32_t mode = d->regs[ADC2_CFGR2] >> 30, hz = chip.bus_hz[1];
    uint32_t divider = mode == 1 ? 2 : mode == 2 ? 4 : 1;

    if (!(d->regs[ADC2_CR] & ADC2_ADEN) || !mode)
        chip_fault("converter is off, or has no clock");
    if (hz / divider > (is_f0 ? 14000000u : 35000000u))
        chip_fault("converter at %u Hz", hz / divider);
    d->shift = (uint32_t)__builtin_ctz(d->regs[ADC2_CHSELR] | 1u << 31);
    d->due = chip.cycle + (sample + 13u) * divider;
    chip_wake_at(d->due);
}

static uint32_t
adc2_read(struct device *d, uint32_t word)
{
    if (word == ADC2_DR)
        d->regs[ADC2_ISR] &= ~(uint32_t)ADC2_EOC;
    return d->regs[word];
}

static void
adc2_write(struct device *d, uint32_t word, uint32_t value)
{
    bool is_g0 = chip.model->line == LINE_G0;

    if (word == ADC2_ISR) {
        d->regs[ADC2_ISR] &= ~value;
        return;
    }
    if (word == ADC2_CHSELR)
        d->regs[ADC2_ISR] |= is_g0 ? ADC2_CCRDY : 0;
    if (word != ADC2_CR) {
        d->regs[word] = value;
        return;
    }
    if (is_g0 && value & (ADC2_ADEN | 1u << 31) && !(value & (1u << 28)))
        chip_fault("converter without its regulator");
    if (value & ADC2_ADEN)
        d->regs[ADC2_ISR] |= ADC2_ADRDY;
    if (value & ADC2_ADSTP) {
        d->due = NEVER;
        value &= ~(uint32_t)(ADC2_ADSTP | ADC2_ADSTART);
    }
    d->regs[ADC2_CR] = value & ~(1u << 31);
    if (value & ADC2_ADSTART)
        adc2_start(d);
}

/*
 * ADC of the G4, L4 and H7: ISR, CR, EOC and DR are where the F0 has them
 */

enum { ADC3_SMPR = 5, ADC3_PCSEL = 7, ADC3_SQR1 = 12 };

static void
adc3_start(struct device *d)
{
    static const uint16_t g4[] = { 2, 6, 12, 24, 47, 92, 247, 640 };
    static const uint16_t h7[] = { 1, 2, 8, 16, 32, 64, 387, 810 };
    bool is_h7 = chip.model->line == LINE_H7;
    uint32_t channel = (d->regs[ADC3_SQR1] >> 6) & 31;
    uint32_t smpr = d->regs[ADC3_SMPR + channel / 10] >> (3 * (channel % 10));

    if (!(d->regs[ADC2_CR] & ADC2_ADEN))
        chip_fault("converter is off");
    if (is_h7 && !(d->regs[ADC3_PCSEL] & (1u << channel)))
        chip_fault("channel %u is not preselected", channel);
    d->shift = channel;
    d->due = chip.cycle + (is_h7 ? (h7[smpr & 7] + 9u) * (chip.core_hz / 16000000)
                           : (g4[smpr & 7] + 13u) * 4);
    chip_wake_at(d->due);
}

static void
adc3_write(struct device *d, uint32_t word, uint32_t value)
{
    if (word == ADC2_ISR) {
        d->regs[ADC2_ISR] &= ~value;
        return;
    }
    if (word != ADC2_CR) {
        d->regs[word] = value;
        return;
    }
    if (value & (1u << 29))
        chip_fault("converter in deep sleep");
    if (value & (ADC2_ADEN | 1u << 31) && !(value & (1u << 28)))
        chip_fault("converter without its regulator");
    if (value & ADC2_ADEN)
        d->regs[ADC2_ISR] |= ADC2_ADRDY;
    if (value & ADC2_ADSTP)
        d->due = NEVER;
    value |= d->regs[ADC2_CR] & ADC2_ADEN;
    d->regs[ADC2_CR] = value & ~(1u << 31 | ADC2_ADSTP);
    if (value & ADC2_ADSTART)
        adc3_start(d);
}

/*
 * Timers that the program counts with
 */

enum { TIM_CR1 = 0, TIM_CNT = 9, TIM_PSC = 10 };

/* Timer 1 counts the overflows of timer 3 where that is the clock. */
static uint32_t
count_timer(struct device *d)
{
    bool is_chained = chip.model->clock_timer == 3;
    uint64_t ticks = chip.cycle - d->zero;

    if (!(d->regs[TIM_CR1] & 1))
        return d->regs[TIM_CNT];
    if (is_chained && d->info->index == 1)
        return (uint32_t)((chip.cycle - chip.cyccnt_zero) >> 16) & 0xffff;
    ticks /= d->regs[TIM_PSC] + 1;
    return (uint32_t)ticks & (is_chained ? 0xffff : UINT32_MAX);
}

static void
timer_write(struct device *d, uint32_t word, uint32_t value)
{
    bool starts = word == TIM_CR1 && value & 1 && !(d->regs[TIM_CR1] & 1);

    d->regs[word] = value;
    update_pwm();
    if (!starts)
        return;
    d->zero = chip.cycle;
    if (d->info->index == chip.model->clock_timer && !chip.is_counting) {
        chip.cyccnt_zero = chip.cycle;
        chip.is_counting = true;
        chip_wake_at(chip.cycle);
    }
}

/*
 * SPI: a byte takes eight bits' time; the world's bus is the number of the
 * peripheral.  An H7 counts the bytes of a transfer.
 */

enum { SPI_CR1 = 0, SPI_CR2 = 1, SPI_SR = 2, SPI_DR = 3,
       SPI_H7_CFG1 = 2, SPI_H7_CFG2 = 3, SPI_H7_SR = 5, SPI_H7_IFCR = 6,
       SPI_H7_TXDR = 8, SPI_H7_RXDR = 12 };
enum { SPI_RXNE = 1, SPI_TXE = 2, SPI_BSY = 0x80, SPI_EOT = 8 };

static bool
is_h7(void)
{
    return chip.model->line == LINE_H7;
}

/* A byte goes out; what comes in is there when its time has passed. */
static void
spi_send(struct device *d, uint32_t value)
{
    uint8_t byte = (uint8_t)value;
    uint32_t cr1 = d->regs[SPI_CR1], divider;
    bool is_on = is_h7() ? (cr1 & 0x201) == 0x201
        && d->regs[SPI_H7_CFG2] & (1u << 22) : (cr1 & 0x44) == 0x44;

    if (!is_on) {
        chip_fault("spi %u is no master, or off", d->info->index);
        return;
    }
    divider = is_h7() ? d->regs[SPI_H7_CFG1] >> 28 & 7 : cr1 >> 3 & 7;
    chip.host.spi(chip.host.ctx, chip_now(), d->info->index, &byte, 1);
    d->rx_data = byte;
    d->due = chip.cycle + (uint64_t)(16u << divider)
        * (chip.core_hz / chip.bus_hz[d->info->bus]);
    chip_wake_at(d->due);
}

static void
spi_event(struct device *d)
{
    if (chip.cycle < d->due)
        return;
    d->due = NEVER;
    d->has_tdr = true;          /* here: something was received */
    d->shift++;
}

static uint32_t
spi_read(struct device *d, uint32_t word)
{
    uint32_t status = (d->has_tdr ? SPI_RXNE : 0)
        | (d->due == NEVER && !d->has_tdr ? SPI_TXE : 0);

    if (is_h7() && word == SPI_H7_SR)
        return status | (d->shift >= d->regs[SPI_CR2] ? SPI_EOT : 0);
    if (!is_h7() && word == SPI_SR)
        return status | (d->due == NEVER ? 0 : SPI_BSY);
    if (word != (is_h7() ? SPI_H7_RXDR : SPI_DR))
        return d->regs[word];
    d->has_tdr = false;
    return d->rx_data;
}

static void
spi_write(struct device *d, uint32_t word, uint32_t value)
{
    if (word == (is_h7() ? SPI_H7_TXDR : SPI_DR)) {
        spi_send(d, value);
        return;
    }
    if (is_h7() && word == SPI_CR2)
        d->shift = 0;
    d->regs[word] = value;
}

/*
 * The watchdog
 */

static void
iwdg_write(struct device *d, uint32_t word, uint32_t value)
{
    bool is_on = d->due != NEVER;

    if (word != 0) {
        d->regs[word] = value;
        return;
    }
    if (value == 0xcccc)
        is_on = true;
    else if (value != 0xaaaa)
        return;
    if (is_on)
        d->due = chip.cycle + (uint64_t)chip.core_hz
            * ((d->regs[2] ? d->regs[2] : 4095) << (d->regs[1] + 2)) / LSI_HZ;
    chip_wake_at(d->due);
}

static void
iwdg_event(struct device *d)
{
    if (chip.cycle < d->due)
        return;
    d->due = NEVER;
    chip.wants_reset = true;
}

/*
 * The bus
 */

static struct device *
find_device(uint32_t addr)
{
    struct device *found = NULL;
    uint32_t i, nearest = MAX_REGS * 4;

    for (i = 0; i < chip.n_devices; i++) {
        struct device *d = &chip.devices[i];

        if (addr - d->info->base < nearest) {
            nearest = addr - d->info->base;
            found = d;
        }
    }
    if (!found)
        chip_fault("nothing is modelled at 0x%08x", addr);
    else if (!rcc_has_clock(found))
        chip_fault("0x%08x has no clock", addr);
    return chip.is_broken ? NULL : found;
}

static uint64_t
bus_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    uint32_t addr = PERIPH_BASE + (uint32_t)offset, word;
    struct device *d = find_device(addr);

    (void)uc;
    (void)param;
    if (!d || (size != 4 && d->info->kind != DEV_SPI))
        return 0;
    word = (addr - d->info->base) / 4;
    switch ((enum device_kind)d->info->kind) {
    case DEV_GPIO:
        return gpio_read(d, word);
    case DEV_USART:
        return usart_read(d, word);
    case DEV_ADC:
        return chip.model->adc_version == 1 ? adc_read(d, word)
            : adc2_read(d, word);
    case DEV_SPI:
        return spi_read(d, word);
    case DEV_TIM:
        return word == TIM_CNT ? count_timer(d) : d->regs[word];
    case DEV_RCC:
        return rcc_read(d, word * 4);
    case DEV_PWR:
        /* what was asked for is so at once: the flags are where the bits are */
        if (chip.model->line == LINE_H7)
            return d->regs[word] | (word == 1 || word == 6 ? 1u << 13 : 0);
        return word == 1 ? d->regs[0] & (3u << 16) : d->regs[word];
    default:
        return d->regs[word];
    }
}

static void
bus_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
          void *param)
{
    uint32_t addr = PERIPH_BASE + (uint32_t)offset, word;
    struct device *d = find_device(addr);

    (void)uc;
    (void)param;
    if (!d)
        return;
    if (size != 4 && d->info->kind != DEV_SPI) {
        chip_fault("%u bytes written to 0x%08x", size, addr);
        return;
    }
    word = (addr - d->info->base) / 4;
    switch ((enum device_kind)d->info->kind) {
    case DEV_GPIO:
        gpio_write(d, word, (uint32_t)value);
        return;
    case DEV_USART:
        usart_write(d, word, (uint32_t)value);
        return;
    case DEV_ADC:
        if (chip.model->adc_version == 1)
            adc_write(d, word, (uint32_t)value);
        else if (chip.model->adc_version == 2)
            adc2_write(d, word, (uint32_t)value);
        else
            adc3_write(d, word, (uint32_t)value);
        return;
    case DEV_SPI:
        spi_write(d, word, (uint32_t)value);
        return;
    case DEV_TIM:
        timer_write(d, word, (uint32_t)value);
        return;
    case DEV_RCC:
        rcc_write(d, word * 4, (uint32_t)value);
        return;
    case DEV_IWDG:
        iwdg_write(d, word, (uint32_t)value);
        return;
    default:
        d->regs[word] = (uint32_t)value;
    }
}

void
periph_run_events(void)
{
    uint32_t i;

    for (i = 0; i < chip.n_devices; i++) {
        struct device *d = &chip.devices[i];

        if (chip.cycle < d->due)
            continue;
        if (d->info->kind == DEV_USART)
            usart_event(d);
        else if (d->info->kind == DEV_ADC)
            adc_event(d);
        else if (d->info->kind == DEV_SPI)
            spi_event(d);
        else if (d->info->kind == DEV_IWDG)
            iwdg_event(d);
    }
}

uint64_t
periph_next_event(void)
{
    uint64_t next = NEVER;
    uint32_t i;

    for (i = 0; i < chip.n_devices; i++)
        if (chip.devices[i].info->kind != DEV_RCC
            && chip.devices[i].due < next)
            next = chip.devices[i].due;
    return next;
}

void
periph_map(uc_engine *uc)
{
    if (uc_mmio_map(uc, PERIPH_BASE, PERIPH_SIZE, bus_read, NULL, bus_write,
                    NULL))
        chip_fault("no peripherals");
}

static void
reset_device(struct device *d)
{
    d->due = NEVER;
    switch ((enum device_kind)d->info->kind) {
    case DEV_USART:
        d->regs[0] = SR_TXE | SR_TC;
        return;
    case DEV_RCC:
        chip.rcc = d;
        rcc_reset(d);
        return;
    case DEV_FLASH:
        chip.flash_ctrl = d;
        return;
    case DEV_PWR:
        chip.pwr = d;
        d->regs[0x20] = 1u << 8;    /* CR5 of a G4: no boost */
        return;
    case DEV_SYSCFG:
        chip.syscfg = d;
        return;
    case DEV_GPIO:
        if (!chip.model->gpio_v2)
            d->regs[0] = d->regs[1] = 0x44444444;
        return;
    default:
        return;
    }
}

void
periph_reset(void)
{
    const struct device_info *info = chip.model->devices;

    for (; info->base; info++) {
        struct device *d = &chip.devices[chip.n_devices++];

        memset(d, 0, sizeof(*d));
        d->info = info;
        reset_device(d);
    }
    chip.core_hz = chip.bus_hz[0] = chip.bus_hz[1] = chip.bus_hz[2]
        = chip.model->hsi_hz;
}
