/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Clocks of an STM32: oscillators, PLL, buses, and what may not be (RM0008,
 * chapter 7; RM0090, chapters 5 and 7; RM0091, chapter 6; RM0444, chapter 5;
 * RM0440, chapter 7; RM0351, chapter 6; data sheets, operating conditions).
 */
#include <string.h>

#include "unicorn_stm32.h"

/* Oscillators and PLL are ready this much later */
enum { READY_CYCLES = 40 };
enum { HSE_ON = 1u << 16, HSE_READY = 1u << 17,
       PLL_ON = 1u << 24, PLL_READY = 1u << 25 };

static uint32_t
check(const char *what, uint32_t hz, uint32_t low, uint32_t high)
{
    if (hz < low || hz > high)
        chip_fault("%s of %u Hz, allowed are %u to %u", what, hz, low, high);
    return hz;
}

/*
 * Frequency behind the PLL, from the registers
 */

static uint32_t
f1_pll_hz(const uint32_t *regs)
{
    uint32_t cfgr = regs[1], factor = ((cfgr >> 18) & 15) + 2;
    uint32_t input = chip.model->hsi_hz / 2;

    if (cfgr & (1u << 16))
        input = cfgr & (1u << 17) ? chip.hse_hz / 2 : chip.hse_hz;
    check("PLL input", input, 1000000, 25000000);
    return input * (factor > 16 ? 16 : factor);
}

static uint32_t
f0_pll_hz(const uint32_t *regs)
{
    uint32_t cfgr = regs[1], factor = ((cfgr >> 18) & 15) + 2;
    uint32_t input = chip.model->hsi_hz / 2;

    if (cfgr & (1u << 16))
        input = chip.hse_hz / ((regs[11] & 15) + 1);
    check("PLL input", input, 1000000, 24000000);
    return input * (factor > 16 ? 16 : factor);
}

static uint32_t
f4_pll_hz(const uint32_t *regs)
{
    uint32_t cfg = regs[1], m = cfg & 63, n = (cfg >> 6) & 511;
    uint32_t p = 2 * ((cfg >> 16) & 3) + 2;
    uint32_t input = cfg & (1u << 22) ? chip.hse_hz : chip.model->hsi_hz;

    if (m < 2 || n < 50) {
        chip_fault("PLL with M %u, N %u", m, n);
        return 1;
    }
    check("PLL input", input / m, 950000, 2100000);
    return check("VCO", input / m * n, 100000000, 432000000) / p;
}

/* M and R of the G0 lie elsewhere than those of the G4 and L4. */
static uint32_t
g_pll_hz(const uint32_t *regs)
{
    bool is_g0 = chip.model->line == LINE_G0;
    uint32_t cfg = regs[3], n = (cfg >> 8) & 127;
    uint32_t m = ((cfg >> 4) & (chip.model->line == LINE_G4 ? 15 : 7)) + 1;
    uint32_t r = is_g0 ? (cfg >> 29) + 1 : 2 * ((cfg >> 25) & 3) + 2;
    uint32_t source = cfg & 3;
    uint32_t input = source == 3 ? chip.hse_hz : source == 2 ? 16000000 : 0;

    if (!(cfg & (is_g0 ? 1u << 28 : 1u << 24)))
        chip_fault("output R of the PLL is off");
    check("PLL input", input / m, 2660000, 16000000);
    return check("VCO", input / m * n, 64000000, 344000000) / r;
}

static uint32_t
h7_pll_hz(const uint32_t *regs)
{
    uint32_t select = regs[10], divider = regs[12], m = (select >> 4) & 63;
    uint32_t source = select & 3, n = (divider & 511) + 1;
    uint32_t p = ((divider >> 9) & 127) + 1;
    uint32_t input = source == 2 ? chip.hse_hz : source == 0 ? 64000000 : 0;

    if (!m || !(regs[11] & (1u << 16)) || (regs[11] & 0xc) != 8) {
        chip_fault("PLL with M %u, configuration 0x%x", m, regs[11]);
        return 1;
    }
    check("PLL input", input / m, 4000000, 8000000);
    return check("VCO", input / m * n, 192000000, 836000000) / p;
}

/* Where the bits of a line are. */
struct layout {
    uint8_t cfgr;               /* word */
    uint32_t on;                /* oscillators and PLL, in CR */
    uint8_t hsi_ready;          /* distance of that from its enable bit */
    uint8_t sws, hse, pll;      /* shift; values of SW */
    uint8_t ppre1, ppre2;       /* shifts */
    uint32_t step_hz;           /* per wait state of flash */
    uint32_t max1_hz, max2_hz;  /* of the buses, as parts of max_hz */
    uint32_t (*pll_hz)(const uint32_t *regs);
};
static const struct layout layouts[] = {
    [LINE_F1] = { 1, 1u, 1, 2, 1, 2, 8, 11, 24000000, 2, 1, f1_pll_hz },
    [LINE_F2F4F7] = { 2, 1u, 1, 2, 1, 2, 10, 13, 30000000, 4, 2, f4_pll_hz },
    [LINE_F0] = { 1, 1u, 1, 2, 1, 2, 8, 8, 24000000, 1, 1, f0_pll_hz },
    [LINE_G0] = { 2, 1u << 8, 2, 3, 1, 2, 12, 12, 24000000, 1, 1, g_pll_hz },
    [LINE_G4] = { 2, 1u << 8, 2, 2, 2, 3, 8, 11, 34000000, 1, 1, g_pll_hz },
    [LINE_L4] = { 2, 1u | 1u << 8, 2, 2, 2, 3, 8, 11, 16000000, 1, 1,
                  g_pll_hz },
    [LINE_H7] = { 4, 1u, 2, 3, 2, 3, 4, 8, 70000000, 4, 4, h7_pll_hz },
};

static const struct layout *
find_layout(void)
{
    return &layouts[chip.model->line];
}

/*
 * Frequencies in use
 */

static uint32_t
shift_of(uint32_t field)
{
    return field & 4 ? (field & 3) + 1 : 0;
}

/* Wait states of flash that a frequency needs, at 3.3 V. */
static void
check_wait_states(uint32_t hz)
{
    uint32_t need = (hz - 1) / find_layout()->step_hz;
    uint32_t have = chip.flash_ctrl->regs[0]
        & (chip.model->line == LINE_F1 ? 7 : 15);

    if (have < need)
        chip_fault("%u wait states at %u Hz, %u are needed", have, hz, need);
}

/* Above 168 MHz an F4 or F7 needs its overdrive, above 150 MHz a G4 its
 * boost, above 300 MHz an H7 its highest voltage. */
static void
check_voltage(uint32_t hz)
{
    if (chip.model->line == LINE_F2F4F7 && hz > 168000000
        && (chip.pwr->regs[0] & (3u << 16)) != (3u << 16))
        chip_fault("%u Hz without overdrive", hz);
    if (chip.model->line == LINE_G4 && hz > 150000000
        && chip.pwr->regs[0x20] & (1u << 8))
        chip_fault("%u Hz without boost", hz);
    if (chip.model->line == LINE_H7 && hz > 300000000
        && ((chip.pwr->regs[6] >> 14) & 3) != (hz > 400000000 ? 0 : 3))
        chip_fault("%u Hz at too low a voltage", hz);
}

/* Of a bus, whose limit is a part of the core's; slow F4 keep those of
 * 168 MHz. */
static uint32_t
bus_hz(const char *name, uint32_t hz, uint32_t field, uint32_t part)
{
    uint32_t limit = chip.model->max_hz / part;

    if (chip.model->line == LINE_F2F4F7 && limit < 168000000 / part)
        limit = 168000000 / part;
    return check(name, hz >> shift_of(field), 1, limit);
}

static void
find_buses(uint32_t hz)
{
    const struct layout *layout = find_layout();
    bool is_h7 = chip.model->line == LINE_H7;
    uint32_t cfgr = chip.rcc->regs[is_h7 ? 7 : layout->cfgr];
    uint32_t ahb = (is_h7 ? chip.rcc->regs[6] : cfgr >> 4) & 15;

    chip.core_hz = chip.bus_hz[0] = check("core", hz, 1, chip.model->max_hz);
    if (ahb & 8)
        hz >>= (ahb & 7) + 1 + (ahb >= 12);
    if (!is_h7)
        chip.core_hz = chip.bus_hz[0] = hz;
    check("bus", hz, 1, is_h7 ? chip.model->max_hz / 2 : chip.model->max_hz);
    chip.bus_hz[1] = bus_hz("bus 1", hz, (cfgr >> layout->ppre1) & 7,
                            layout->max1_hz);
    chip.bus_hz[2] = bus_hz("bus 2", hz, (cfgr >> layout->ppre2) & 7,
                            layout->max2_hz);
    check_wait_states(hz);
    check_voltage(chip.core_hz);
}

/* The program has chosen another source, or other dividers. */
static void
switch_clock(uint32_t source)
{
    const struct layout *layout = find_layout();
    const uint32_t *regs = chip.rcc->regs;

    if (source == layout->pll && regs[0] & PLL_READY)
        find_buses(layout->pll_hz(regs));
    else if (source == layout->hse && regs[0] & HSE_READY)
        find_buses(chip.hse_hz);
    else if (source < layout->hse)
        find_buses(chip.model->hsi_hz);
    else
        chip_fault("switched to clock %u, which does not run", source);
}

/*
 * Registers
 */

/* The ready bits that belong to enable bits. */
static uint32_t
ready_of(uint32_t cr)
{
    const struct layout *layout = find_layout();
    uint32_t on = cr & layout->on;

    /* bit 0 is HSI, or MSI of an L4, whose HSI is bit 8 */
    return (on & 1 ? chip.model->line == LINE_H7 ? 4u : 2u : 0)
        | (on & ~1u) << layout->hsi_ready
        | (cr & PLL_ON ? PLL_READY : 0)
        | (cr & HSE_ON && chip.hse_hz ? HSE_READY : 0);
}

/* What is on becomes ready after a while. */
static void
update_ready(struct device *d)
{
    if (chip.cycle >= d->due)
        d->regs[0] = (d->regs[0] & ~ready_of(UINT32_MAX))
            | ready_of(d->regs[0]);
}

/* The oscillator of 48 MHz, and the second PLL: register, and its bits. */
static void
find_extra(uint32_t *word, uint32_t *on)
{
    enum line line = chip.model->line;

    *word = line == LINE_F0 ? 13 : line == LINE_G4 || line == LINE_L4 ? 38 : 0;
    *on = line == LINE_F0 ? 1u << 16 : line == LINE_G0 ? 1u << 22
        : line == LINE_H7 ? 1u << 12 : line == LINE_F2F4F7 ? 1u << 28
        : line == LINE_F1 ? 0 : 1u;
}

static bool
is_extra_on(void)
{
    uint32_t word, on;

    find_extra(&word, &on);
    return chip.rcc->regs[word] & on;
}

uint32_t
rcc_read(struct device *d, uint32_t offset)
{
    uint32_t word, on;

    update_ready(d);
    find_extra(&word, &on);
    if (offset / 4 == word && d->regs[word] & on)
        return d->regs[word] | on << 1;
    return d->regs[offset / 4];
}

/* Output Q of the PLL, or output P of the second. */
static uint32_t
f4_usb_hz(const uint32_t *regs)
{
    uint32_t cfg = regs[1], sai = regs[0x88 / 4];
    uint32_t source = cfg & (1u << 22) ? chip.hse_hz : chip.model->hsi_hz;
    uint32_t m = cfg & 63, n = cfg >> 6 & 511, q = cfg >> 24 & 15;

    if (!(regs[0x94 / 4] & (1u << 27)))
        return source / m * n / q;
    if (!is_extra_on())
        return 0;
    m = sai & 63;
    return check("input of the second PLL", source / m, 950000, 2100000)
        * (sai >> 6 & 511) / (2 * (sai >> 16 & 3) + 2);
}

static uint32_t
usb_hz(void)
{
    const uint32_t *regs = chip.rcc->regs;
    uint32_t own = is_extra_on() ? 48000000 : 0;

    switch (chip.model->line) {
    case LINE_F1:
        return regs[1] & (1u << 22) ? chip.core_hz : chip.core_hz / 3 * 2;
    case LINE_F2F4F7:
        return f4_usb_hz(regs);
    case LINE_F0:
        return regs[12] & (1u << 7) ? chip.core_hz : own;
    case LINE_G0:
        return regs[0x58 / 4] & (3u << 12) ? 0 : own;
    case LINE_H7:
        return (regs[0x54 / 4] >> 20 & 3) == 3 ? own : 0;
    default:
        return regs[0x88 / 4] & (3u << 26) ? 0 : own;
    }
}

void
stm32_check_usb_clock(void)
{
    static const char *const precise[] = { "stm32f070" };
    uint32_t hz = usb_hz();
    struct device *crs = stm32_find(DEV_CRS, 0);
    bool is_tuned = crs && (crs->regs[0] & 0x60) == 0x60;

    if (hz != 48000000)
        chip_fault("USB at %u Hz", hz);
    if (chip.model->line != LINE_F1 && chip.model->line != LINE_F2F4F7
        && strcmp(chip.model->name, precise[0]) && !is_tuned)
        chip_fault("the oscillator of USB is not tuned by the host");
}

static void
write_cr(struct device *d, uint32_t value)
{
    uint32_t ready = ready_of(UINT32_MAX), kept = d->regs[0] & ready;

    d->regs[0] = (value & ~ready) | (kept & ready_of(value));
    d->due = chip.cycle + READY_CYCLES;
}

void
rcc_write(struct device *d, uint32_t offset, uint32_t value)
{
    const struct layout *layout = find_layout();
    uint32_t word = offset / 4, mask = layout->sws == 3 ? 7 : 3;
    uint32_t pll_word = chip.model->line == LINE_F2F4F7 ? 1
        : chip.model->line == LINE_H7 ? 12 : 3;

    update_ready(d);
    if (word == 0) {
        write_cr(d, value);
        return;
    }
    if (layout->pll_hz != f1_pll_hz && layout->pll_hz != f0_pll_hz
        && word == pll_word && d->regs[0] & PLL_ON)
        chip_fault("PLL changed while it is on");
    d->regs[word] = value;
    if (word == layout->cfgr) {
        d->regs[word] = (value & ~(mask << layout->sws))
            | (value & mask) << layout->sws;
        switch_clock(value & mask);
    }
}

bool
rcc_has_clock(const struct device *d)
{
    return !d->info->gate_offset
        || chip.rcc->regs[d->info->gate_offset / 4] & (1u << d->info->gate_bit);
}

void
rcc_reset(struct device *d)
{
    const struct layout *layout = find_layout();

    /* the L4 starts with MSI */
    d->regs[0] = chip.model->line == LINE_L4 ? 1 : layout->on;
    d->regs[0] |= ready_of(d->regs[0]);
    d->due = 0;
}
