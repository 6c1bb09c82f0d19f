/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Clocks of SAM3X, SAM4 and SAM E70 (11057, chapter 28; 11100, chapter 29;
 * DS60001527, chapter 31; electrical characteristics of each).
 */
#include "unicorn_sam.h"

enum { SCER = 0, SCDR = 4, PCER0 = 0x10, PCDR0 = 0x14, PCSR0 = 0x18,
       UCKR = 0x1c, MOR = 0x20, PLLAR = 0x28, MCKR = 0x30, PCK0 = 0x40, SR = 0x68,
       PCER1 = 0x100, PCDR1 = 0x104, PCSR1 = 0x108 };
enum { SLOW_HZ = 32768, READY_CYCLES = 40 };
enum { XTEN = 1, RCEN = 8, MOSCSEL = 1 << 24 };

/* Bounds of the PLL's output, of the peripherals' clock, and frequency for each
 * wait state of flash */
static const struct {
    uint32_t pll_min, pll_max, mck_max, step_hz;
} limits[] = {
    [SAM3X] = { 96000000, 192000000, 84000000, 19000000 },
    [SAM4S] = { 80000000, 240000000, 120000000, 20000000 },
    [SAM4E] = { 80000000, 240000000, 120000000, 20000000 },
    [SAME70] = { 160000000, 500000000, 150000000, 23000000 },
};

static uint64_t crystal_at, pll_at, ready_at;

static struct device *
pmc(void)
{
    return bus_find(SAM_PMC, 0);
}

static uint64_t
slow_cycles(uint32_t count)
{
    return (uint64_t)count * chip.core_hz / SLOW_HZ;
}

static uint32_t
main_hz(const struct device *d)
{
    return d->regs[MOR / 4] & MOSCSEL ? chip.hse_hz : chip.model->hsi_hz;
}

static uint32_t
pll_hz(const struct device *d)
{
    uint32_t pll = d->regs[PLLAR / 4], line = sam_line();
    uint32_t hz = main_hz(d) / (pll & 255 ? pll & 255 : 1)
        * ((pll >> 16 & 0x7ff) + 1);

    if (!(pll & 255) || hz < limits[line].pll_min || hz > limits[line].pll_max)
        chip_fault("PLL at %u Hz", hz);
    return hz;
}

/* Each flash controller has the wait states that the clock needs. */
static void
check_flash(uint32_t mck)
{
    uint32_t need = (mck - 1) / limits[sam_line()].step_hz, i;

    for (i = 0; i < chip.n_devices; i++) {
        struct device *d = &chip.devices[i];

        if (d->info->kind == SAM_EFC && (d->regs[0] >> 8 & 15) < need)
            chip_fault("%u wait states at %u Hz, %u are needed",
                       d->regs[0] >> 8 & 15, mck, need);
    }
}

static void
update_core(struct device *d)
{
    static const uint8_t dividers[] = { 1, 2, 4, 3 };
    uint32_t mckr = d->regs[MCKR / 4], pres = mckr >> 4 & 7, hz;

    if ((mckr & 3) == 2 && chip.cycle < pll_at)
        chip_fault("switched to the PLL before it has locked");
    if (!(mckr & 3) || (mckr & 3) == 3)
        chip_fault("clock source %u is not modelled", mckr & 3);
    hz = (mckr & 3) == 2 ? pll_hz(d) : main_hz(d);
    hz = pres == 7 ? hz / 3 : hz >> pres;
    if (hz > chip.model->max_hz)
        chip_fault("core at %u Hz", hz);
    chip.core_hz = hz;
    if (sam_line() == SAME70)
        hz /= dividers[mckr >> 8 & 3];
    if (hz > limits[sam_line()].mck_max)
        chip_fault("peripherals at %u Hz", hz);
    chip.bus_hz[1] = hz;
    check_flash(hz);
}

static void
write_mor(struct device *d, uint32_t value)
{
    uint32_t was = d->regs[MOR / 4];

    if ((value >> 16 & 0xff) != 0x37) {
        chip_fault("MOR without its key: 0x%08x", value);
        return;
    }
    if (value & XTEN && !(was & XTEN))
        crystal_at = chip.hse_hz
            ? chip.cycle + slow_cycles(8 * (value >> 8 & 255)) : NEVER;
    if (value & MOSCSEL && chip.cycle < crystal_at)
        chip_fault("crystal chosen before it is steady");
    if (!(value & MOSCSEL) && !(value & RCEN))
        chip_fault("the oscillator in use is off");
    d->regs[MOR / 4] = value & ~0xff0000u;
    update_core(d);
}

static void
write_pll(struct device *d, uint32_t value)
{
    if (!(value & 1u << 29))
        chip_fault("PLLAR without its bit 29");
    if ((d->regs[MCKR / 4] & 3) == 2)
        chip_fault("PLL changed while it is in use");
    d->regs[PLLAR / 4] = value;
    pll_at = value >> 16 & 0x7ff ? chip.cycle
        + slow_cycles(value >> 8 & 63) : NEVER;
}

/* One field at a time, and not before the last change is through. */
static void
write_mckr(struct device *d, uint32_t value)
{
    uint32_t changed = value ^ d->regs[MCKR / 4];

    if (chip.cycle < ready_at)
        chip_fault("MCKR written before the clock is ready");
    if (!!(changed & 3) + !!(changed & 0x70) + !!(changed & 0x300) > 1)
        chip_fault("several fields of MCKR changed at once");
    d->regs[MCKR / 4] = value;
    ready_at = chip.cycle + READY_CYCLES;
    update_core(d);
}

static uint32_t
read_status(const struct device *d)
{
    uint32_t mor = d->regs[MOR / 4];

    return (mor & XTEN && chip.cycle >= crystal_at ? 1u : 0)
        | (chip.cycle >= pll_at ? 2u : 0)
        | (chip.cycle >= ready_at ? 8u : 0) | 1u << 16
        | (d->regs[UCKR / 4] & 1u << 16 ? 1u << 6 : 0)
        | (mor & RCEN ? 1u << 17 : 0) | (d->regs[SCER / 4 + 2] & 0x7f00);
}

static uint32_t
pmc_read(struct device *d, uint32_t offset)
{
    return offset == SR ? read_status(d) : d->regs[offset / 4];
}

static void
pmc_write(struct device *d, uint32_t offset, uint32_t value)
{
    switch (offset) {
    case SCER:
    case PCER0:
    case PCER1:
        d->regs[offset / 4 + 2] |= value;
        return;
    case SCDR:
    case PCDR0:
    case PCDR1:
        d->regs[offset / 4 + 1] &= ~value;
        return;
    case MOR:
        write_mor(d, value);
        return;
    case PLLAR:
        write_pll(d, value);
        return;
    case MCKR:
        write_mckr(d, value);
        return;
    default:
        if (offset >= PCK0 && offset < PCK0 + 32
            && d->regs[SCER / 4 + 2] & 0x100u << (offset - PCK0) / 4)
            chip_fault("a programmable clock is changed while it runs");
        d->regs[offset / 4] = value;
    }
}

static void
pmc_reset(struct device *d)
{
    d->regs[MOR / 4] = RCEN;
    d->regs[MCKR / 4] = 1;
    crystal_at = pll_at = NEVER;
    ready_at = 0;
    chip.bus_hz[1] = chip.core_hz;
}

const struct device_ops sam_pmc_ops = { pmc_reset, pmc_read, pmc_write, NULL };

static void
efc_write(struct device *d, uint32_t offset, uint32_t value)
{
    d->regs[offset / 4] = value;
    if (offset == 0)
        check_flash(chip.bus_hz[1]);
    if (offset == 4)
        sam_flash_command(d, value);
}

/* Status: ready, unless the number is being shown */
static uint32_t
efc_read(struct device *d, uint32_t offset)
{
    return offset == 8 ? !d->shift : d->regs[offset / 4];
}

const struct device_ops sam_efc_ops = { NULL, efc_read, efc_write, NULL };

uint32_t
sam_pck_hz(uint32_t number)
{
    uint32_t pck = pmc()->regs[PCK0 / 4 + number];

    if (!(pmc()->regs[SCER / 4 + 2] & 0x100u << number) || (pck & 7) != 2)
        return 0;
    return pll_hz(pmc()) / ((pck >> 4 & 255) + 1);
}

uint32_t
sam_pll_hz(void)
{
    return pll_hz(pmc());
}

bool
sam_is_on(uint32_t id)
{
    return pmc()->regs[(id < 32 ? PCSR0 : PCSR1) / 4] & 1u << id % 32;
}

bool
sam_has_clock(const struct device *d)
{
    return !d->info->gate_offset || sam_is_on(d->info->irq);
}

uint32_t
sam_divider(void)
{
    return chip.core_hz / chip.bus_hz[1];
}
