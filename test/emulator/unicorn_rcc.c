/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Clocks of an STM32: oscillators, PLL, buses, and what may not be (RM0008,
 * chapter 7; RM0090, chapters 5 and 7; data sheets, operating conditions).
 */
#include "unicorn_chip.h"

/* Oscillators and PLL are ready this much later */
enum { READY_CYCLES = 40 };

/* Where the registers of a line are, as words */
struct layout {
    uint8_t cr, cfgr;
};
static const struct layout layouts[] = {
    [LINE_F1] = { 0, 1 }, [LINE_F2F4F7] = { 0, 2 },
};

static uint32_t
check(const char *what, uint32_t hz, uint32_t low, uint32_t high)
{
    if (hz < low || hz > high)
        chip_fault("%s of %u Hz, allowed are %u to %u", what, hz, low, high);
    return hz;
}

/* Frequency behind the PLL of an F1. */
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
f4_pll_hz(const uint32_t *regs)
{
    uint32_t cfg = regs[1], m = cfg & 63, n = (cfg >> 6) & 511;
    uint32_t p = 2 * ((cfg >> 16) & 3) + 2;
    uint32_t input = cfg & (1u << 22) ? chip.hse_hz : chip.model->hsi_hz;

    if (m < 2 || n < 50)
        chip_fault("PLL with M %u, N %u", m, n);
    else
        check("PLL input", input / m, 950000, 2100000);
    if (chip.is_broken)
        return 1;
    return check("VCO", input / m * n, 100000000, 432000000) / p;
}

static uint32_t
shift_of(uint32_t field)
{
    return field & 4 ? (field & 3) + 1 : 0;
}

/* Wait states of flash that a frequency needs, at 3.3 V. */
static void
check_wait_states(uint32_t hz)
{
    static const uint32_t steps[] = {
        [LINE_F1] = 24000000, [LINE_F2F4F7] = 30000000,
    };
    uint32_t need = (hz - 1) / steps[chip.model->line];
    uint32_t acr = chip.flash_ctrl->regs[0];
    uint32_t have = acr & (chip.model->line == LINE_F1 ? 7 : 15);

    if (have < need)
        chip_fault("%u wait states at %u Hz, %u are needed", have, hz, need);
}

/* Above 168 MHz an F4 or F7 needs its overdrive. */
static void
check_voltage(uint32_t hz)
{
    if (chip.model->line != LINE_F2F4F7 || hz <= 168000000)
        return;
    if ((chip.pwr->regs[0] & (3u << 16)) != (3u << 16))
        chip_fault("%u Hz without overdrive", hz);
}

static void
find_buses(uint32_t hz)
{
    uint32_t cfgr = chip.rcc->regs[layouts[chip.model->line].cfgr];
    bool is_f1 = chip.model->line == LINE_F1;
    uint32_t first = is_f1 ? 8 : 10;

    chip.core_hz = chip.bus_hz[0] = hz;
    chip.bus_hz[1] = hz >> shift_of((cfgr >> first) & 7);
    chip.bus_hz[2] = hz >> shift_of((cfgr >> (first + 3)) & 7);
    check("core", hz, 1, chip.model->max_hz);
    check("bus 1", chip.bus_hz[1], 1,
          is_f1 ? 36000000 : (chip.model->max_hz + 3) / 4 > 42000000
          ? (chip.model->max_hz + 3) / 4 : 42000000);
    check("bus 2", chip.bus_hz[2], 1,
          is_f1 ? 72000000 : (chip.model->max_hz + 1) / 2 > 84000000
          ? (chip.model->max_hz + 1) / 2 : 84000000);
    check_wait_states(hz);
    check_voltage(hz);
}

/* The program has chosen another source. */
static void
switch_clock(uint32_t source)
{
    const uint32_t *regs = chip.rcc->regs;
    uint32_t cr = regs[0];

    if (source == 0)
        find_buses(chip.model->hsi_hz);
    else if (source == 1 && cr & (1u << 17))
        find_buses(chip.hse_hz);
    else if (source == 2 && cr & (1u << 25))
        find_buses(chip.model->line == LINE_F1 ? f1_pll_hz(regs)
                   : f4_pll_hz(regs));
    else
        chip_fault("switched to clock %u, which does not run", source);
}

/* What is on becomes ready after a while. */
static void
update_ready(struct device *d)
{
    uint32_t *cr = &d->regs[0], on = *cr & (1u << 0 | 1u << 16 | 1u << 24);

    if (chip.cycle >= d->due)
        *cr = (*cr & ~(1u << 1 | 1u << 17 | 1u << 25)) | on << 1;
    if (!chip.hse_hz)
        *cr &= ~(1u << 17);
}

uint32_t
rcc_read(struct device *d, uint32_t offset)
{
    update_ready(d);
    return d->regs[offset / 4];
}

static void
write_cr(struct device *d, uint32_t value)
{
    uint32_t kept = d->regs[0] & (1u << 1 | 1u << 17 | 1u << 25);
    uint32_t on = value & (1u << 0 | 1u << 16 | 1u << 24);

    d->regs[0] = (value & ~(1u << 1 | 1u << 17 | 1u << 25))
        | (kept & on << 1);
    d->due = chip.cycle + READY_CYCLES;
}

void
rcc_write(struct device *d, uint32_t offset, uint32_t value)
{
    const struct layout *layout = &layouts[chip.model->line];
    uint32_t word = offset / 4, source = value & 3;

    update_ready(d);
    if (word == layout->cr) {
        write_cr(d, value);
        return;
    }
    if (chip.model->line == LINE_F2F4F7 && word == 1
        && d->regs[0] & (1u << 24))
        chip_fault("PLL changed while it is on");
    d->regs[word] = value;
    if (word == layout->cfgr) {
        d->regs[word] = (value & ~0xcu) | source << 2;
        switch_clock(source);
    }
}

bool
rcc_has_clock(const struct device *d)
{
    return !d->info->gate_offset
        || chip.rcc->regs[d->info->gate_offset / 4] & (1u << d->info->gate_bit);
}
