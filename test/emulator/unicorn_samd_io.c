/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * SERCOM, converters and TCC of SAM D21, C21 and D5x.
 */
#include <string.h>

#include "unicorn_samd.h"

enum { CTRLA = 0, CTRLB = 4, BAUD = 0xc, INTENCLR = 0x14, INTENSET = 0x16,
       INTFLAG = 0x18, STATUS = 0x1a, ADDR = 0x24, DATA = 0x28 };
enum { DRE = 1, TXC = 2, RXC = 4, MB = 1, SB = 2, RXNACK = 4, BUFOVF = 4 };
enum { MODE_USART = 1, MODE_SPI = 3, MODE_I2C = 5 };
#define PIN(LETTER, BIT) (((LETTER) - 'A') * 32 + (BIT))

/* Pads that tests use: unit, pad, pin, function C (2) or D (3), lines */
static const struct pad {
    uint8_t unit, pad, pin, mux, lines;
} pads[] = {
    { 0, 3, PIN('A', 11), 2, 7 }, { 0, 2, PIN('A', 10), 2, 7 },
    { 0, 1, PIN('A', 5), 3, 7 }, { 0, 0, PIN('A', 4), 3, 7 },
    { 1, 0, PIN('A', 16), 2, 7 }, { 1, 1, PIN('A', 17), 2, 7 },
    { 1, 2, PIN('A', 18), 2, 7 }, { 1, 3, PIN('A', 19), 2, 7 },
    { 3, 0, PIN('A', 22), 2, 7 }, { 3, 1, PIN('A', 23), 2, 7 },
    { 5, 0, PIN('A', 23), 3, 4 }, { 5, 1, PIN('A', 22), 3, 4 },
};

static uint32_t
mode_of(const struct samd_device *d)
{
    return samd_get(d, CTRLA, 4) >> 2 & 7;
}

/* Some pin must lead to a pad that is used. */
static void
check_pad(const struct samd_device *d, uint32_t pad)
{
    uint32_t i;

    for (i = 0; i < sizeof(pads) / sizeof(pads[0]); i++)
        if (pads[i].unit == d->info->index && pads[i].pad == pad
            && pads[i].lines & (1u << samd.line)
            && samd_mux_of(pads[i].pin) == pads[i].mux)
            return;
    chip_fault("sercom %u: no pin at pad %u", d->info->index, pad);
}

static void
check_pads(const struct samd_device *d)
{
    static const uint8_t data[] = { 0, 2, 3, 0 }, clock[] = { 1, 3, 1, 3 };
    uint32_t ctrla = samd_get(d, CTRLA, 4), out = ctrla >> 16 & 3;
    uint32_t in = ctrla >> 20 & 3;

    /* a D5x has not all of the choices */
    if (samd.line == SAMD51 && mode_of(d) != MODE_I2C && out & 1)
        chip_fault("sercom %u cannot send like that", d->info->index);
    if (mode_of(d) == MODE_USART) {
        check_pad(d, out == 1 ? 2 : 0);
        check_pad(d, in);
    } else if (mode_of(d) == MODE_SPI) {
        check_pad(d, data[out]);
        check_pad(d, clock[out]);
    } else {
        check_pad(d, 0);
        check_pad(d, 1);
    }
}

static void
update_irq(struct samd_device *d)
{
    uint32_t on = d->regs[INTFLAG] & d->inten, i;

    if (samd.line != SAMD51) {
        core_set_level(16u + d->info->irq, on != 0);
        return;
    }
    for (i = 0; i < 3; i++)
        core_set_level(16u + d->info->irq + i, on >> i & 1);
    core_set_level(16u + d->info->irq + 3u, on >> 3);
}

/*
 * Usart
 */

static uint64_t
byte_cycles(const struct samd_device *d)
{
    double baud = samd_feed_hz(d) / 16. * (1 - samd_get(d, BAUD, 2) / 65536.);

    if (baud < chip.baud * .97 || baud > chip.baud * 1.03) {
        chip_fault("usart at %.0f baud instead of %u", baud, chip.baud);
        return 1;
    }
    return (uint64_t)(10. * chip.core_hz / baud);
}

static void
usart_send(struct samd_device *d, uint8_t byte)
{
    if (d->is_shifting && d->has_next)
        chip_fault("a byte too much for the usart");
    if (d->is_shifting) {
        d->next = byte;
        d->has_next = true;
        d->regs[INTFLAG] &= (uint8_t)~DRE;
        return;
    }
    d->shift = byte;
    d->is_shifting = true;
    d->due = chip.cycle + byte_cycles(d);
    chip_wake_at(d->due);
}

static void
usart_event(struct samd_device *d)
{
    d->due = NEVER;
    chip.host.tx(chip.host.ctx, chip_now(), &d->shift, 1);
    d->is_shifting = false;
    d->regs[INTFLAG] |= DRE;
    if (d->has_next) {
        d->has_next = false;
        usart_send(d, d->next);
    }
}

void
samd_usart_rx(struct samd_device *d, uint8_t byte)
{
    d->next_rx = chip.cycle + byte_cycles(d);
    if (d->n_rx == 2)
        d->regs[STATUS] |= BUFOVF;
    else
        d->rx[d->n_rx++] = byte;
    d->regs[INTFLAG] |= RXC;
    update_irq(d);
}

/*
 * SPI: a byte takes eight bits' time
 */

static void
spi_send(struct samd_device *d, uint8_t byte)
{
    if (d->is_shifting || !(samd_get(d, CTRLB, 4) & 0x20000)) {
        chip_fault("spi %u is not ready", d->info->index);
        return;
    }
    chip.host.spi(chip.host.ctx, chip_now(), d->info->index, &byte, 1);
    d->shift = byte;
    d->is_shifting = true;
    d->due = chip.cycle + 16ull * (samd_get(d, BAUD, 1) + 1) * chip.core_hz
        / samd_feed_hz(d);
    chip_wake_at(d->due);
}

void
samd_sercom_event(struct samd_device *d)
{
    if (mode_of(d) == MODE_USART) {
        usart_event(d);
    } else {
        d->due = NEVER;
        d->is_shifting = false;
        d->rx[0] = d->shift;
        d->n_rx = 1;
        d->regs[INTFLAG] |= RXC | TXC;
    }
    update_irq(d);
}

/*
 * I2C: bytes take no time; a read asks the world for more than there may be
 */

static bool
ask_world(struct samd_device *d, uint32_t n_write, uint32_t n_read)
{
    return chip.host.i2c(chip.host.ctx, chip_now(), d->info->index,
                         (uint8_t)(samd_get(d, ADDR, 4) >> 1), d->wr, n_write,
                         d->rd, n_read) >= 0;
}

static void
i2c_start(struct samd_device *d, uint32_t addr)
{
    double hz = samd_feed_hz(d) / (10. + 2. * samd_get(d, BAUD, 1));
    bool is_ok;

    if (!(samd_get(d, STATUS, 2) & 0x30))
        chip_fault("i2c %u does not know whether the bus is idle",
                   d->info->index);
    if (hz > 450000)
        chip_fault("i2c %u at %.0f Hz", d->info->index, hz);
    samd_put(d, ADDR, 4, addr);
    d->is_reading = addr & 1;
    d->n_read = 0;
    is_ok = d->is_reading ? ask_world(d, d->n_written, sizeof(d->rd))
        : ask_world(d, 0, 0);
    if (!d->is_reading)
        d->n_written = 0;
    samd_put(d, STATUS, 2, 0x20 | (is_ok ? 0 : RXNACK));
    d->regs[INTFLAG] = d->is_reading && is_ok ? SB : MB;
}

static void
i2c_command(struct samd_device *d, uint32_t command)
{
    if (!d->regs[INTFLAG])
        chip_fault("i2c %u is told to go on while it does", d->info->index);
    if (command == 2 && d->is_reading) {
        d->n_read++;
        return;
    }
    d->regs[INTFLAG] = 0;
    if (command != 3)
        return;
    if (!d->is_reading && d->n_written)
        ask_world(d, d->n_written, 0);
    d->n_written = 0;
    samd_put(d, STATUS, 2, 0x10);
}

static void
i2c_data(struct samd_device *d, uint8_t byte)
{
    if (d->regs[INTFLAG] != MB || samd_get(d, STATUS, 2) & RXNACK)
        chip_fault("i2c %u cannot send", d->info->index);
    d->wr[d->n_written++ & 255] = byte;
}

/*
 * Registers of SERCOM
 */

static void
write_data(struct samd_device *d, uint32_t value)
{
    if (!(samd_get(d, CTRLA, 4) & 2))
        chip_fault("sercom %u is off", d->info->index);
    if (mode_of(d) == MODE_USART)
        usart_send(d, (uint8_t)value);
    else if (mode_of(d) == MODE_SPI)
        spi_send(d, (uint8_t)value);
    else
        i2c_data(d, (uint8_t)value);
}

static void
write_ctrla(struct samd_device *d, uint32_t value)
{
    bool was_on = samd_get(d, CTRLA, 4) & 2;

    if (value & 1) {
        memset(d->regs, 0, sizeof(d->regs));
        d->inten = d->n_rx = 0;
        return;
    }
    if (was_on && (value ^ samd_get(d, CTRLA, 4)) & ~2u)
        chip_fault("sercom %u is changed while it is on", d->info->index);
    samd_put(d, CTRLA, 4, value);
    if (!(value & 2) || was_on)
        return;
    check_pads(d);
    if (mode_of(d) != MODE_I2C)
        d->regs[INTFLAG] |= DRE;
    else
        samd_put(d, STATUS, 2, 0);
    if (mode_of(d) == MODE_USART)
        samd.console = d;
}

void
samd_sercom_write(struct samd_device *d, uint32_t offset, uint32_t size,
                  uint32_t value)
{
    (void)samd_feed_hz(d);
    switch (offset) {
    case CTRLA:
        write_ctrla(d, value);
        break;
    case CTRLB:
        if (mode_of(d) == MODE_I2C && value >> 16 & 3)
            i2c_command(d, value >> 16 & 3);
        else
            samd_put(d, CTRLB, 4, value);
        break;
    case INTENCLR:
        d->inten &= (uint8_t)~value;
        break;
    case INTENSET:
        d->inten |= (uint8_t)value;
        break;
    case INTFLAG:
        d->regs[INTFLAG] &= (uint8_t)~(value & TXC);
        break;
    case STATUS:
        if (mode_of(d) == MODE_I2C)
            samd_put(d, STATUS, 2, value & 0x10);
        else
            d->regs[STATUS] &= (uint8_t)~value;
        break;
    case ADDR:
        i2c_start(d, value);
        break;
    case DATA:
        write_data(d, value);
        break;
    default:
        samd_put(d, offset, size, value);
    }
    update_irq(d);
}

uint32_t
samd_sercom_read(struct samd_device *d, uint32_t offset, uint32_t size)
{
    uint8_t byte;

    if (offset == INTENSET || offset == INTENCLR)
        return d->inten;
    if (offset != DATA)
        return samd_get(d, offset, size);
    if (mode_of(d) == MODE_I2C)
        return d->rd[d->n_read % sizeof(d->rd)];
    byte = d->rx[0];
    d->rx[0] = d->rx[1];
    d->n_rx -= d->n_rx != 0;
    if (!d->n_rx)
        d->regs[INTFLAG] &= (uint8_t)~RXC;
    update_irq(d);
    return byte;
}

/*
 * Converters: what differs is where registers are
 */

static const struct adc_map {
    uint8_t ctrla_size, prescaler, refctrl, input, swtrig, intflag, result;
} adc_maps[] = {
    { 1, 4, 1, 0x10, 0xc, 0x18, 0x1a },
    { 1, 1, 2, 0x08, 0x18, 0x06, 0x24 },
    { 2, 0, 8, 0x04, 0x14, 0x2e, 0x40 },
};

/* The pin of a channel; -1 without. */
static int
adc_pin(uint32_t unit, uint32_t channel)
{
    static const char *const names[] = {
        "A2 A3 B8 B9 A4 A5 A6 A7 B0 B1 B2 B3 B4 B5 B6 B7 A8 A9 A10A11",
        "A2 A3 B8 B9 A4 A5 A6 A7 A8 A9 A10A11",
        "A2 A3 B8 B9 A4 A5 A6 A7 A8 A9 A10A11B0 B1 B2 B3 ",
        "B8 B9 A8 A9 C2 C3 B4 B5 B6 B7 C0 C1 C30C31D0 D1 ",
    };
    const char *name = names[samd.line == SAMD51 ? 2 + unit : samd.line];

    if (3 * channel + 1 >= strlen(name))
        return -1;
    name += 3 * channel;
    return (name[0] - 'A') * 32 + (name[1] - '0')
        + (name[2] >= '0' && name[2] <= '9' ? 9 * (name[1] - '0')
           + name[2] - '0' : 0);
}

/* The converter's clock within its limits, its reference the supply. */
static void
adc_check(struct samd_device *d)
{
    const struct adc_map *map = &adc_maps[samd.line];
    uint32_t divider, ref = samd_get(d, map->refctrl, 1) & 15;
    uint32_t hz, input = samd_get(d, map->input, samd.line == SAMD21 ? 4 : 2);

    divider = samd.line == SAMD21 ? 4u << (samd_get(d, 4, 2) >> 8 & 7)
        : samd.line == SAMC21 ? 2u << (samd_get(d, 1, 1) & 7)
        : 2u << (samd_get(d, 0, 2) >> 8 & 7);
    hz = samd_feed_hz(d) / divider;
    if (hz > (samd.line == SAMD21 ? 2100000u : 16000000u) || hz < 30000)
        chip_fault("converter at %u Hz", hz);
    if (samd.line == SAMD21 ? ref != 2 || input >> 24 != 15
        : ref != (samd.line == SAMC21 ? 5u : 3u))
        chip_fault("the converter does not measure parts of the supply");
    if ((input >> 8 & 31) != 0x18)
        chip_fault("the converter does not measure against ground");
    d->due = chip.cycle + (uint64_t)(32 + 12) * chip.core_hz / hz;
    chip_wake_at(d->due);
}

void
samd_adc_write(struct samd_device *d, uint32_t offset, uint32_t size,
               uint32_t value)
{
    const struct adc_map *map = &adc_maps[samd.line];
    int pin;

    (void)samd_feed_hz(d);
    if (offset == map->intflag) {
        d->regs[offset] &= (uint8_t)~value;
        return;
    }
    if (offset != map->swtrig) {
        samd_put(d, offset, size, value);
        return;
    }
    if (value & 1)
        d->due = NEVER;
    if (!(value & 2))
        return;
    if (!(samd_get(d, 0, map->ctrla_size) & 2))
        chip_fault("the converter is off");
    adc_check(d);
    pin = adc_pin(d->info->index, samd_get(d, map->input, 1) & 31);
    if (pin >= 0 && samd_mux_of((uint32_t)pin) != 1)
        chip_fault("pin %d is no analog input", pin);
}

#define AT_25_DEGREES 828       /* 0.667 V of 3.3 V */
#define FALLING_AT_25_DEGREES 869
#define SUPC_ADDRESS 0x40001800

/* What the chip's sensors show; a D51 has two, and a register that chooses. */
static uint32_t
adc_temperature(uint32_t channel)
{
    uint32_t i, vref = 0;

    if (samd.line != SAMD51)
        return AT_25_DEGREES;
    for (i = 0; i < samd.n_devices; i++)
        if (samd.devices[i].info->base == SUPC_ADDRESS)
            vref = samd_get(&samd.devices[i], 0x1c, 4);
    if (!(vref & 2))
        chip_fault("the temperature sensors are off");
    if (vref & 0x80 ? channel == 0x1d : vref & 8)
        return FALLING_AT_25_DEGREES;
    return AT_25_DEGREES;
}

void
samd_adc_event(struct samd_device *d)
{
    const struct adc_map *map = &adc_maps[samd.line];
    uint32_t channel = samd_get(d, map->input, 1) & 31;
    int pin = adc_pin(d->info->index, channel);

    d->due = NEVER;
    samd_put(d, map->result, 2, pin < 0 ? adc_temperature(channel)
             : chip.host.adc_in(chip.host.ctx, chip_now(), (uint32_t)pin) >> 4);
    d->regs[map->intflag] |= 1;
}

/*
 * TCC
 */

void
samd_tcc_update(struct samd_device *d)
{
    static const struct { uint8_t pin, mux, unit, channel; } outputs[] = {
        { PIN('A', 16), 4, 2, 0 }, { PIN('A', 17), 4, 2, 1 },
        { PIN('A', 8), 4, 0, 0 }, { PIN('A', 20), 5, 0, 2 },
        { PIN('A', 30), 4, 1, 0 },
    };
    static const uint16_t dividers[] = { 1, 2, 4, 8, 16, 64, 256, 1024 };
    uint32_t ctrla = samd_get(d, 0, 4), i;

    if (!(ctrla & 2) || (samd_get(d, 0x3c, 4) & 7) != 2)
        return;
    for (i = 0; i < sizeof(outputs) / sizeof(outputs[0]); i++) {
        uint32_t channel = outputs[i].channel, now[3];
        uint32_t *told = samd.pwm_told[d->info->index][channel];

        if (outputs[i].unit != d->info->index
            || samd_mux_of(outputs[i].pin) != outputs[i].mux)
            continue;
        now[2] = samd_get(d, 0x40, 4) + 1;
        now[0] = now[2] * dividers[ctrla >> 8 & 7]
            * (chip.core_hz / samd_feed_hz(d));
        now[1] = samd_get(d, 0x44 + 4 * channel, 4);
        if (!memcmp(told, now, sizeof(now)))
            continue;
        memcpy(told, now, sizeof(now));
        chip.host.pwm_out(chip.host.ctx, chip_now(), outputs[i].pin, now[0],
                          now[1], now[2]);
    }
}
