/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A SAM D21, C21 or D5x: its bus with gates, generators of clocks, oscillators,
 * pins, watchdog and the timer that counts (data sheets DS40001882, DS60001479,
 * DS60001507).  Registers of another clock are there at once.
 */
#include <string.h>

#include "unicorn_samd.h"
#include "unicorn_canhost.h"
#include "unicorn_usbhost.h"

#define APB_BASE 0x40000000u
#define IOBUS_BASE 0x60000000u
#define ROWS_BASE 0x00800000u

struct samd_state samd;

/* base, kind, index, irq, gate, channel */
#define CORE(BASE, KIND) { BASE, KIND, 0, 0, 0, 0, -1 }
static const struct samd_info d21_devices[] = {
    CORE(0x40000400, SAMD_GATES), CORE(0x40000800, SAMD_OSC),
    CORE(0x40000c00, SAMD_GCLK), { 0x40001000, SAMD_WDT, 0, 0, 0, 0, 3 },
    CORE(0x41004000, SAMD_NVM), { 0x41004400, SAMD_PORT, 0, 0, 0x1c, 3, -1 },
    { 0x41005000, SAMD_USB, 0, 7, 0x1c, 5, 6 },
    { 0x42000800, SAMD_SERCOM, 0, 9, 0x20, 2, 20 },
    { 0x42000c00, SAMD_SERCOM, 1, 10, 0x20, 3, 21 },
    { 0x42001000, SAMD_SERCOM, 2, 11, 0x20, 4, 22 },
    { 0x42001400, SAMD_SERCOM, 3, 12, 0x20, 5, 23 },
    { 0x42001800, SAMD_SERCOM, 4, 13, 0x20, 6, 24 },
    { 0x42001c00, SAMD_SERCOM, 5, 14, 0x20, 7, 25 },
    { 0x42002000, SAMD_TCC, 0, 0, 0x20, 8, 26 },
    { 0x42002400, SAMD_TCC, 1, 0, 0x20, 9, 26 },
    { 0x42002800, SAMD_TCC, 2, 0, 0x20, 10, 27 },
    { 0x42003000, SAMD_TC, 0, 0, 0x20, 12, 28 },
    { 0x42004000, SAMD_ADC, 0, 0, 0x20, 16, 30 },
    { .base = 0 },
};
static const struct samd_info c21_devices[] = {
    CORE(0x40000800, SAMD_GATES), CORE(0x40001000, SAMD_OSC),
    CORE(0x40001c00, SAMD_GCLK), CORE(0x40002000, SAMD_WDT),
    CORE(0x41004000, SAMD_NVM), { 0x41000000, SAMD_PORT, 0, 0, 0x18, 0, -1 },
    { 0x42000400, SAMD_SERCOM, 0, 9, 0x1c, 1, 19 },
    { 0x42000800, SAMD_SERCOM, 1, 10, 0x1c, 2, 20 },
    { 0x42000c00, SAMD_SERCOM, 2, 11, 0x1c, 3, 21 },
    { 0x42001000, SAMD_SERCOM, 3, 12, 0x1c, 4, 22 },
    { 0x42001400, SAMD_SERCOM, 4, 13, 0x1c, 5, 23 },
    { 0x42001800, SAMD_SERCOM, 5, 14, 0x1c, 6, 25 },
    { 0x42001c00, SAMD_CAN, 0, 15, 0x10, 8, 26 },
    { 0x42002000, SAMD_CAN, 1, 16, 0x10, 9, 27 },
    { 0x42002400, SAMD_TCC, 0, 0, 0x1c, 9, 28 },
    { 0x42002800, SAMD_TCC, 1, 0, 0x1c, 10, 28 },
    { 0x42002c00, SAMD_TCC, 2, 0, 0x1c, 11, 29 },
    { 0x42003000, SAMD_TC, 0, 0, 0x1c, 12, 30 },
    { 0x42004400, SAMD_ADC, 0, 0, 0x1c, 17, 33 },
    { .base = 0 },
};
static const struct samd_info d51_devices[] = {
    CORE(0x40000800, SAMD_GATES), CORE(0x40001000, SAMD_OSC),
    CORE(0x40001400, SAMD_OSC32K), CORE(0x40001800, SAMD_PLAIN),
    CORE(0x40001c00, SAMD_GCLK), CORE(0x40002000, SAMD_WDT),
    CORE(0x41006000, SAMD_PLAIN), { 0x41008000, SAMD_PORT, 0, 0, 0x18, 4, -1 },
    { 0x41000000, SAMD_USB, 0, 80, 0x18, 0, 10 },
    { 0x40003000, SAMD_SERCOM, 0, 46, 0x14, 12, 7 },
    { 0x40003400, SAMD_SERCOM, 1, 50, 0x14, 13, 8 },
    { 0x41012000, SAMD_SERCOM, 2, 54, 0x18, 9, 23 },
    { 0x41014000, SAMD_SERCOM, 3, 58, 0x18, 10, 24 },
    { 0x43000000, SAMD_SERCOM, 4, 62, 0x20, 0, 34 },
    { 0x43000400, SAMD_SERCOM, 5, 66, 0x20, 1, 35 },
    { 0x43000800, SAMD_SERCOM, 6, 70, 0x20, 2, 36 },
    { 0x43000c00, SAMD_SERCOM, 7, 74, 0x20, 3, 37 },
    { 0x42000000, SAMD_CAN, 0, 78, 0x10, 17, 27 },
    { 0x42000400, SAMD_CAN, 1, 79, 0x10, 18, 28 },
    { 0x43001c00, SAMD_ADC, 0, 0, 0x20, 7, 40 },
    { 0x43002000, SAMD_ADC, 1, 0, 0x20, 8, 41 },
    { .base = 0 },
};

uint32_t
samd_get(const struct samd_device *d, uint32_t offset, uint32_t size)
{
    uint32_t value = 0;

    memcpy(&value, &d->regs[offset], size);
    return value;
}

void
samd_put(struct samd_device *d, uint32_t offset, uint32_t size, uint32_t value)
{
    memcpy(&d->regs[offset], &value, size);
}

/*
 * Oscillators and PLLs
 */

static bool
has_crystal_32k(void)
{
    uint32_t ctrl = samd.line == SAMD21 ? samd_get(samd.osc, 0x14, 2)
        : samd.line == SAMD51 ? samd_get(samd.osc32k, 0x14, 2) : 0;

    return chip.hse_hz == 32768 && (ctrl & 0xe) == 0xe
        && chip.cycle >= samd.xosc_ready;
}

static uint32_t
crystal_hz(void)
{
    uint32_t ctrl = samd.line == SAMC21 ? samd_get(samd.osc, 0x10, 2)
        : samd.line == SAMD51 ? samd_get(samd.osc, 0x18, 4) : 0;

    return chip.hse_hz > 1000000 && (ctrl & 6) == 6
        && chip.cycle >= samd.xosc_ready ? chip.hse_hz : 0;
}

static uint32_t generator_hz(uint32_t number);

/* What a PLL multiplies. */
static double
pll_reference(uint32_t pll)
{
    uint32_t ctrlb, source, feed;

    if (samd.line == SAMD51) {
        ctrlb = samd_get(samd.osc, 0x38 + 0x14 * pll, 4);
        source = ctrlb >> 5 & 7;
        feed = samd.feeds[1 + pll];
        return source == 1 ? has_crystal_32k() * 32768.
            : source == 0 && feed ? generator_hz(feed - 1u) : 0;
    }
    ctrlb = samd_get(samd.osc, samd.line == SAMD21 ? 0x4c : 0x24, 4);
    source = ctrlb >> 4 & 3;
    if (source == 0)
        return has_crystal_32k() * 32768.;
    return source == 1 ? crystal_hz() / (2. * ((ctrlb >> 16 & 0x7ff) + 1)) : 0;
}

static uint32_t
pll_hz(uint32_t pll)
{
    uint32_t at = samd.line == SAMD21 ? 0x48 : samd.line == SAMC21 ? 0x20
        : 0x34 + 0x14 * pll;
    uint32_t ratio = samd_get(samd.osc, at, 4);
    double ref = pll_reference(pll), hz, frac = samd.line == SAMD51 ? 32 : 16;
    double least = samd.line == SAMD51 ? 96e6 : 48e6;
    double most = samd.line == SAMD51 ? 200e6 : 96.1e6;

    hz = ref * ((ratio & 0x1fff) + 1 + (ratio >> 16) / frac);
    if (chip.cycle < samd.pll_ready[pll])
        chip_fault("PLL %u is used before it is locked", pll);
    if (ref < 32000 || ref > 3.2e6 || hz < least || hz > most)
        chip_fault("PLL %u makes %.0f Hz of %.0f Hz", pll, hz, ref);
    return (uint32_t)(hz + .5);
}

static uint32_t
source_hz(uint32_t source)
{
    static const uint8_t d21[] = { 9, 9, 9, 2, 9, 3, 8, 4, 5 };
    static const uint8_t c21[] = { 1, 9, 9, 2, 9, 3, 7, 5, 9 };
    static const uint8_t d51[] = { 9, 1, 9, 9, 2, 3, 4, 5, 6 };
    const uint8_t *kinds = samd.line == SAMD21 ? d21 : samd.line == SAMC21
        ? c21 : d51;
    bool dfll;

    switch (source <= 8 ? kinds[source] : 9) {
    case 1:
        return crystal_hz();
    case 2:
        return 32768;
    case 3:
        return has_crystal_32k() * 32768;
    case 4:
        dfll = samd.line == SAMD21 ? samd_get(samd.osc, 0x24, 2) & 2
            : samd_get(samd.osc, 0x1c, 1) & 2;
        return dfll ? 48000000 : 0;
    case 5:
    case 6:
        return pll_hz(source - (samd.line == SAMD21 ? 8 : 7));
    case 7:
        return 48000000 / ((samd_get(samd.osc, 0x15, 1) & 15) + 1);
    case 8:
        return 8000000u >> (samd_get(samd.osc, 0x20, 4) >> 8 & 3);
    default:
        return 0;
    }
}

static uint32_t
generator_hz(uint32_t number)
{
    uint32_t hz = 0;

    if (samd.gen_div[number])
        hz = source_hz(samd.gen_src[number]) / samd.gen_div[number];
    if (!hz)
        chip_fault("generator %u has no source", number);
    return hz;
}

/* The processor's: generator 0; flash must keep up. */
static void
update_core(void)
{
    uint32_t hz = generator_hz(0), waits = 0, needed = 0;

    chip.core_hz = hz;
    if (hz > chip.model->max_hz)
        chip_fault("core at %u Hz", hz);
    if (samd.line == SAMD51)
        return;
    waits = samd_get(samd.nvm, 4, 4) >> 1 & 15;
    needed = samd.line == SAMD21 ? hz > 24000000
        : (hz > 19000000) + (hz > 38000000);
    if (waits < needed)
        chip_fault("%u wait states at %u Hz", waits, hz);
}

uint32_t
samd_feed_hz(const struct samd_device *d)
{
    uint8_t feed = samd.feeds[d->info->channel & 63];

    if (!feed) {
        chip_fault("0x%08x is fed by no generator", d->info->base);
        return 1;
    }
    return generator_hz(feed - 1u);
}

/* A channel's generator; it can change while the channel is off. */
static void
set_feed(uint32_t channel, uint8_t feed)
{
    if (samd.feeds[channel] && feed && samd.feeds[channel] != feed)
        chip_fault("clock channel %u is changed while it is on", channel);
    samd.feeds[channel] = feed;
}

static void
d21_gclk_write(uint32_t offset, uint32_t size, uint32_t value)
{
    uint32_t number = value & 15, feed = samd.feeds[value & 63];

    /* a byte chooses the channel that is read */
    if (offset == 2 && size == 1) {
        samd_put(samd.gclk, 2, 2, (value & 63)
                 | (feed ? 0x4000 | (feed - 1) << 8 : 0));
        return;
    }
    if (offset == 2) {
        set_feed(value & 63, value & 0x4000 ? (value >> 8 & 15) + 1 : 0);
        samd_put(samd.gclk, 2, 2, value);
        return;
    }
    if (offset == 8) {
        samd.gclk->latch = value >> 8 & 0xffff;
        samd.gclk->n_read = number;
        return;
    }
    if (offset != 4)
        return;
    samd.gen_src[number] = value >> 8 & 31;
    samd.gen_div[number] = !(value & 0x10000) ? 0
        : samd.gclk->n_read == number && samd.gclk->latch ? samd.gclk->latch
        : 1;
    update_core();
}

static void
gclk_write(uint32_t offset, uint32_t size, uint32_t value)
{
    uint32_t number = (offset - 0x20) / 4;

    if (samd.line == SAMD21) {
        d21_gclk_write(offset, size, value);
        return;
    }
    samd_put(samd.gclk, offset, size, value);
    if (offset >= 0x80) {
        set_feed((offset - 0x80) / 4 & 63, value & 0x40 ? (value & 15) + 1 : 0);
    } else if (offset >= 0x20) {
        samd.gen_src[number] = value & 31;
        samd.gen_div[number] = !(value & 0x100) ? 0 : value >> 16 ? value >> 16
            : 1;
        update_core();
    }
}

/* Something was switched on: it needs its time. */
static void
osc_write(struct samd_device *d, uint32_t offset, uint32_t size, uint32_t value)
{
    uint64_t ready = chip.cycle + chip.core_hz / 2000;
    uint32_t pll_at = samd.line == SAMD21 ? 0x44 : samd.line == SAMC21 ? 0x1c
        : 0x30;
    bool is_pll = d == samd.osc
        && (offset == pll_at || (samd.line == SAMD51 && offset == 0x44));
    uint32_t pll = offset == pll_at ? 0 : 1;
    bool turned_on = value & 2 && !(samd_get(d, offset, size) & 2);

    samd_put(d, offset, size, value);
    if (is_pll)
        samd.pll_ready[pll] = !(value & 2) ? NEVER
            : turned_on ? ready : samd.pll_ready[pll];
    else if (turned_on && (offset == 0x10 || offset == 0x14 || offset == 0x18))
        samd.xosc_ready = ready;
}

static uint32_t
osc_status(struct samd_device *d, uint32_t offset)
{
    bool locked[2] = { chip.cycle >= samd.pll_ready[0],
                       chip.cycle >= samd.pll_ready[1] };

    if (d == samd.osc32k && offset == 0x0c)
        return has_crystal_32k();
    if (samd.line == SAMD21 && offset == 0x0c)
        return has_crystal_32k() << 1 | 8 | 0x10;
    if (samd.line == SAMD21 && offset == 0x50)
        return locked[0] ? 3 : 0;
    if (samd.line == SAMC21 && offset == 0x0c)
        return (crystal_hz() != 0) | 0x10;
    if (samd.line == SAMC21 && offset == 0x30)
        return locked[0] ? 3 : 0;
    if (samd.line == SAMD51 && offset == 0x10)
        return (crystal_hz() != 0) << 1 | (samd_get(d, 0x1c, 1) & 2) << 7;
    if (samd.line == SAMD51 && (offset == 0x40 || offset == 0x54))
        return locked[offset == 0x54] ? 3 : 0;
    return samd_get(d, offset, 4);
}

/*
 * Pins
 */

static uint32_t
pin_config(uint32_t pin)
{
    return samd.port->regs[pin / 32 * 0x80 + 0x40 + pin % 32];
}

int
samd_mux_of(uint32_t pin)
{
    uint32_t pair = samd.port->regs[pin / 32 * 0x80 + 0x30 + pin % 32 / 2];

    return pin_config(pin) & 1 ? (int)(pair >> (pin & 1 ? 4 : 0) & 15) : -1;
}

static void
update_port(uint32_t group)
{
    uint32_t dir = samd_get(samd.port, 0x80 * group, 4), bit, driven = 0;
    uint32_t fresh, changed;

    for (bit = 0; bit < 32; bit++)
        if (dir & (1u << bit) && !(pin_config(32 * group + bit) & 1))
            driven |= 1u << bit;
    fresh = driven & ~samd.told_driven[group];
    samd.told_driven[group] = driven;
    changed = ((samd.told_out[group] ^ samd.out[group]) & driven) | fresh;
    samd.told_out[group] ^= (samd.told_out[group] ^ samd.out[group]) & driven;
    while (changed) {
        bit = (uint32_t)__builtin_ctz(changed);
        changed &= changed - 1;
        chip.host.pin_out(chip.host.ctx, chip_now(), 32 * group + bit,
                          samd.out[group] >> bit & 1);
    }
}

/* A level has changed: nothing else did. */
static void
set_levels(uint32_t group, uint32_t out)
{
    uint32_t changed = (samd.out[group] ^ out) & samd.told_driven[group];

    samd.out[group] = out;
    samd.told_out[group] ^= changed;
    while (changed) {
        uint32_t bit = (uint32_t)__builtin_ctz(changed);

        changed &= changed - 1;
        chip.host.pin_out(chip.host.ctx, chip_now(), 32 * group + bit,
                          out >> bit & 1);
    }
}

static void
update_tccs(void)
{
    uint32_t i;

    for (i = 0; i < samd.n_devices; i++)
        if (samd.devices[i].info->kind == SAMD_TCC)
            samd_tcc_update(&samd.devices[i]);
}

static void
port_write(uint32_t offset, uint32_t size, uint32_t value)
{
    uint32_t group = offset / 0x80, reg = offset % 0x80;
    uint32_t dir = samd_get(samd.port, 0x80 * group, 4);
    uint32_t out = samd.out[group];

    if (reg >= 0x10 && reg < 0x20) {
        set_levels(group, reg == 0x10 ? value : reg == 0x14 ? out & ~value
                   : reg == 0x18 ? out | value : out ^ value);
        return;
    }
    if (reg < 0x10)
        samd_put(samd.port, 0x80 * group, 4,
                 reg == 0 ? value : reg == 4 ? dir & ~value
                 : reg == 8 ? dir | value : dir ^ value);
    else
        samd_put(samd.port, offset, size, value);
    update_port(group);
    update_tccs();
}

static uint32_t
read_inputs(uint32_t group)
{
    uint32_t bit, in = 0;

    for (bit = 0; bit < 32; bit++) {
        uint32_t config = pin_config(32 * group + bit);
        int8_t pull = !(config & 4) ? 0
            : samd.out[group] & (1u << bit) ? 1 : -1;

        if (!(config & 2) || config & 1)
            continue;
        if (samd.told_driven[group] & (1u << bit))
            in |= samd.out[group] & (1u << bit);
        else if (chip.host.pin_in(chip.host.ctx, chip_now(), 32 * group + bit,
                                  pull))
            in |= 1u << bit;
    }
    return in;
}

/*
 * Watchdog and timer
 */

/* CLEAR, or switched on: 8 << period cycles of 1024 Hz. */
static void
wdt_write(struct samd_device *d, uint32_t offset, uint32_t size, uint32_t value)
{
    uint32_t clear = samd.line == SAMD21 ? 8 : 0xc;

    if (offset == clear && value != 0xa5)
        chip_fault("the watchdog gets a wrong key");
    samd_put(d, offset, size, value);
    if (offset != clear && offset != 0)
        return;
    d->due = NEVER;
    if (!(samd_get(d, 0, 1) & 2))
        return;
    if (samd.line == SAMD21 && samd_feed_hz(d) != 1024)
        chip_fault("the watchdog counts %u Hz", samd_feed_hz(d));
    d->due = chip.cycle + (8ull << (samd_get(d, 1, 1) & 15)) * chip.core_hz
        / 1024;
    chip_wake_at(d->due);
}

static void
tc_write(struct samd_device *d, uint32_t offset, uint32_t size, uint32_t value)
{
    if (offset == 0 && value & 1)
        value = 0;              /* a reset, which is over at once */
    samd_put(d, offset, size, value);
    if (offset == 5 && samd.line == SAMC21) {
        samd_put(d, 5, 1, 0);
        d->is_latched = (value >> 5) == 4;
        d->latch = (uint32_t)(chip.cycle - chip.cyccnt_zero);
    }
    if (offset == 2 && samd.line == SAMD21)
        d->is_latched = (value & 0x4000) && (value & 31) == 0x10;
    if (offset != 0 || (value & 0xe) != 0xa || chip.is_counting)
        return;
    if (samd_feed_hz(d) != chip.core_hz)
        chip_fault("the timer counts %u Hz", samd_feed_hz(d));
    chip.cyccnt_zero = chip.cycle;
    chip.is_counting = true;
    chip_wake_at(chip.cycle);
}

static uint32_t
tc_read(struct samd_device *d, uint32_t offset, uint32_t size)
{
    if (offset != (samd.line == SAMD21 ? 0x10 : 0x14))
        return samd_get(d, offset, size);
    if (!d->is_latched)
        chip_fault("the count is read before it was asked for");
    return samd.line == SAMD21 ? (uint32_t)(chip.cycle - chip.cyccnt_zero)
        : d->latch;
}

/*
 * The bus
 */

static struct samd_device *
find_device(uint32_t addr)
{
    uint32_t i, gate;

    for (i = 0; i < samd.n_devices; i++) {
        struct samd_device *d = &samd.devices[i];

        if (addr - d->info->base >= SAMD_REGS
            || (addr - d->info->base >= 0x100 && d->info->kind != SAMD_PORT
                && d->info->kind != SAMD_USB && d->info->kind != SAMD_GCLK))
            continue;
        gate = d->info->gate_offset;
        if (gate && !(samd_get(samd.gates, gate, 4) >> d->info->gate_bit & 1))
            chip_fault("0x%08x has no clock", addr);
        return d;
    }
    chip_fault("nothing is modelled at 0x%08x", addr);
    return NULL;
}

static uint64_t
read_device(struct samd_device *d, uint32_t offset, uint32_t size)
{
    switch (d->info->kind) {
    case SAMD_OSC:
    case SAMD_OSC32K:
        return osc_status(d, offset);
    case SAMD_PORT:
        if (offset % 0x80 == 0x20)
            return read_inputs(offset / 0x80);
        return offset % 0x80 < 0x20 && offset % 0x80 >= 0x10
            ? samd.out[offset / 0x80] : samd_get(d, offset, size);
    case SAMD_SERCOM:
        return samd_sercom_read(d, offset, size);
    case SAMD_TC:
        return tc_read(d, offset, size);
    case SAMD_CAN:
        return samd_can_read(d, offset, size);
    default:
        return samd_get(d, offset, size);
    }
}

static void
write_device(struct samd_device *d, uint32_t offset, uint32_t size,
             uint32_t value)
{
    switch (d->info->kind) {
    case SAMD_GCLK:
        gclk_write(offset, size, value);
        return;
    case SAMD_OSC:
    case SAMD_OSC32K:
        osc_write(d, offset, size, value);
        return;
    case SAMD_PORT:
        port_write(offset, size, value);
        return;
    case SAMD_WDT:
        wdt_write(d, offset, size, value);
        return;
    case SAMD_TC:
        tc_write(d, offset, size, value);
        return;
    case SAMD_SERCOM:
        samd_sercom_write(d, offset, size, value);
        return;
    case SAMD_ADC:
        samd_adc_write(d, offset, size, value);
        return;
    case SAMD_USB:
        samd_usb_write(d, offset, size, value);
        return;
    case SAMD_CAN:
        samd_can_write(d, offset, size, value);
        return;
    default:
        /* a TCC's buffers: with the next cycle, that is, now */
        if (d->info->kind == SAMD_TCC && offset >= 0x70)
            offset -= 0x2c;
        samd_put(d, offset, size, value);
        if (d->info->kind == SAMD_TCC)
            samd_tcc_update(d);
    }
}

static uint64_t
apb_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    uint32_t addr = APB_BASE + (uint32_t)offset;
    struct samd_device *d = find_device(addr);

    (void)uc;
    (void)param;
    return d ? read_device(d, addr - d->info->base, size) : 0;
}

static void
apb_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
          void *param)
{
    uint32_t addr = APB_BASE + (uint32_t)offset;
    struct samd_device *d = find_device(addr);

    (void)uc;
    (void)param;
    if (d)
        write_device(d, addr - d->info->base, size, (uint32_t)value);
}

static uint64_t
iobus_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    (void)uc;
    (void)param;
    return read_device(samd.port, (uint32_t)offset & 0x1ff, size);
}

static void
iobus_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
            void *param)
{
    (void)uc;
    (void)param;
    port_write((uint32_t)offset & 0x1ff, size, (uint32_t)value);
}

/* Calibration and serial number, as a factory might write them. */
static void
map_rows(uc_engine *uc)
{
    static const uint32_t d21[] = { 0x31234567, 0x7fa53e5a };
    static const uint32_t d51[] = { 0x00b6db6c, 0x00000d5f };
    static const uint32_t serial[] = { 0x11223344, 0x55667788, 0x99aabbcc,
                                       0xddeeff01 };
    const uint32_t *rows = samd.line == SAMD51 ? d51 : d21;
    uint32_t at = samd.line == SAMD51 ? 0x80 : 0x6020;
    uint32_t first = samd.line == SAMD51 ? 0x61fc : 0xa00c;
    uint32_t others = samd.line == SAMD51 ? 0x6010 : 0xa040;

    if (uc_mem_map(uc, ROWS_BASE, 0x10000, UC_PROT_READ)
        || uc_mem_write(uc, ROWS_BASE + at, rows, 8)
        || uc_mem_write(uc, ROWS_BASE + first, serial, 4)
        || uc_mem_write(uc, ROWS_BASE + others, serial + 1, 12))
        chip_fault("no rows");
}

static void
samd_map(uc_engine *uc)
{
    samd.line = !strncmp(chip.model->name, "samd21", 6) ? SAMD21
        : !strncmp(chip.model->name, "samc21", 6) ? SAMC21 : SAMD51;
    if (uc_mmio_map(uc, APB_BASE, 0x4000000, apb_read, NULL, apb_write, NULL)
        || (samd.line != SAMD51
            && uc_mmio_map(uc, IOBUS_BASE, 0x1000, iobus_read, NULL,
                           iobus_write, NULL)))
        chip_fault("no peripherals");
    map_rows(uc);
}

static void
set_defaults(void)
{
    switch (samd.line) {
    case SAMD21:
        samd_put(samd.gates, 0x14, 4, 0x7f);
        samd_put(samd.gates, 0x18, 4, 0x7f);
        samd_put(samd.gates, 0x1c, 4, 0x7f);
        samd_put(samd.gates, 0x20, 4, 0x10000);
        samd_put(samd.osc, 0x20, 4, 0x87070382);
        samd.gen_src[0] = 6;
        break;
    case SAMC21:
        samd_put(samd.gates, 0x14, 4, 0xfff);
        samd_put(samd.gates, 0x18, 4, 0x7);
        samd_put(samd.osc, 0x15, 1, 11);
        samd.gen_src[0] = 6;
        break;
    case SAMD51:
        samd_put(samd.gates, 0x14, 4, 0x7ff);
        samd_put(samd.gates, 0x18, 4, 0x18056);
        samd_put(samd.osc, 0x1c, 1, 2);
        samd.gen_src[0] = 6;
    }
    samd.gen_div[0] = 1;
}

static struct samd_device **
named_device(uint8_t kind)
{
    static struct samd_device *other;

    switch (kind) {
    case SAMD_GATES:
        return &samd.gates;
    case SAMD_GCLK:
        return &samd.gclk;
    case SAMD_OSC:
        return &samd.osc;
    case SAMD_OSC32K:
        return &samd.osc32k;
    case SAMD_NVM:
        return &samd.nvm;
    case SAMD_PORT:
        return &samd.port;
    case SAMD_USB:
        return &samd.usb;
    default:
        return &other;
    }
}

static void
samd_reset(void)
{
    const struct samd_info *info = samd.line == SAMD21 ? d21_devices
        : samd.line == SAMC21 ? c21_devices : d51_devices;
    enum samd_line line = samd.line;

    memset(&samd, 0, sizeof(samd));
    samd.line = line;
    samd.pll_ready[0] = samd.pll_ready[1] = samd.xosc_ready = NEVER;
    for (; info->base; info++) {
        struct samd_device *d = &samd.devices[samd.n_devices++];

        d->info = info;
        d->due = NEVER;
        *named_device(info->kind) = d;
        if (info->kind == SAMD_CAN)
            samd_can_reset(d);
    }
    set_defaults();
    update_core();
    canhost_reset();
    samd_usb_start();
}

static void
samd_run_events(void)
{
    uint32_t i;

    for (i = 0; i < samd.n_devices; i++) {
        struct samd_device *d = &samd.devices[i];

        if (chip.cycle < d->due)
            continue;
        if (d->info->kind == SAMD_SERCOM)
            samd_sercom_event(d);
        else if (d->info->kind == SAMD_ADC)
            samd_adc_event(d);
        else
            chip.wants_reset = true;
    }
    usbhost_run_events();
    canhost_run_events();
}

static uint64_t
samd_next_event(void)
{
    uint64_t next = usbhost_next_event(), other = canhost_next_event();
    uint32_t i;

    next = other < next ? other : next;

    for (i = 0; i < samd.n_devices; i++)
        if (samd.devices[i].due < next)
            next = samd.devices[i].due;
    return next;
}

static uint64_t
samd_rx_free_at(void)
{
    if (samd_usb_is_on())
        return usbhost_free_at();
    if (canhost_is_used())
        return canhost_free_at();
    return samd.console ? samd.console->next_rx : NEVER;
}

static void
samd_rx(uint8_t byte)
{
    if (samd_usb_is_on())
        usbhost_rx(byte);
    else if (canhost_is_used())
        canhost_rx(byte);
    else
        samd_usart_rx(samd.console, byte);
}

static int32_t
samd_find_pin(const char *name)
{
    int32_t pin = chip_find_pin(name, 32);

    return pin < SAMD_PINS ? pin : -1;
}

static const struct family samd_family = {
    .flash_base = 0, .map = samd_map, .reset = samd_reset,
    .run_events = samd_run_events, .next_event = samd_next_event,
    .rx_free_at = samd_rx_free_at, .rx = samd_rx, .find_pin = samd_find_pin,
};

#define MODEL(NAME, CPU, FLASH, RAM, HZ) \
    { .name = NAME, .family = &samd_family, .cpu = CPU, .flash_size = FLASH, \
      .ram_base = 0x20000000, .ram_size = RAM, .max_hz = HZ }
#define SMALL(NAME, FLASH, RAM) \
    MODEL(NAME, UC_CPU_ARM_CORTEX_M0, FLASH, RAM, 48000000)
#define LARGE(NAME, FLASH, RAM) \
    MODEL(NAME, UC_CPU_ARM_CORTEX_M4, FLASH, RAM, 200000000)

const struct chip_model samd_models[] = {
    SMALL("samc21g18", 0x40000, 0x8000), SMALL("samd21g18", 0x40000, 0x8000),
    SMALL("samd21e15", 0x8000, 0x1000), LARGE("samd51p20", 0x100000, 0x40000),
    LARGE("same51j19", 0x80000, 0x30000),
    { .name = NULL },
};
