/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Clocks of an LPC176x (UM10360, chapter 4; data sheet, dynamic
 * characteristics; errata sheet, PCLKSELx.1).
 */
#include "unicorn_lpc.h"

enum { FLASHCFG = 0, PLL0CON = 0x80, PLL0CFG = 0x84, PLL0STAT = 0x88,
       PLL0FEED = 0x8c, PLL1CON = 0xa0, PLL1CFG = 0xa4, PLL1STAT = 0xa8,
       PLL1FEED = 0xac, PCONP = 0xc4, CCLKCFG = 0x104, CLKSRCSEL = 0x10c,
       SCS = 0x1a0, PCLKSEL0 = 0x1a8, PCLKSEL1 = 0x1ac, USBINTST = 0x1c0 };
enum { IRC_HZ = 4000000, LOCK_CYCLES = 400, START_CYCLES = 2000 };
enum { OSCEN = 1 << 5, OSCSTAT = 1 << 6 };

/* What a feed has taken over from CON and CFG */
static struct pll {
    uint32_t con, cfg, fed;
    uint64_t locked_at;
} plls[2];
static uint64_t osc_ready_at;

static bool
is_locked(const struct pll *pll)
{
    return pll->con & 1 && chip.cycle >= pll->locked_at;
}

static uint32_t
source_hz(const struct device *d)
{
    uint32_t source = d->regs[CLKSRCSEL / 4] & 3;

    if (source == 0)
        return IRC_HZ;
    if (source == 1 && d->regs[SCS / 4] & OSCEN && chip.cycle >= osc_ready_at)
        return chip.hse_hz;
    chip_fault("clock source %u does not run", source);
    return 1;
}

/* Frequency of the oscillator in PLL0 */
static uint32_t
pll0_hz(struct device *d)
{
    uint32_t m = (plls[0].cfg & 0x7fff) + 1, n = (plls[0].cfg >> 16 & 255) + 1;
    uint64_t hz = 2ull * source_hz(d) * m / n;

    if (m < 6 || m > 512 || n > 32 || hz < 275000000 || hz > 550000000)
        chip_fault("PLL0 with M %u, N %u: %llu Hz, allowed are 275 to 550 MHz",
                   m, n, (unsigned long long)hz);
    return (uint32_t)hz;
}

/* Clocks that a fetch from flash takes: 20 MHz each; the fastest chips do five
 * at 120. */
static void
check_flash(struct device *d, uint32_t hz)
{
    uint32_t clocks = (d->regs[FLASHCFG / 4] >> 12 & 15) + 1;
    uint32_t limit = clocks == 5 ? chip.model->max_hz : clocks * 20000000;

    if (clocks < 6 && hz > limit)
        chip_fault("%u clocks a fetch at %u Hz", clocks, hz);
    if ((d->regs[FLASHCFG / 4] & 0xfff) != 0x3a)
        chip_fault("reserved bits of FLASHCFG were changed");
}

static void
update_core(struct device *d)
{
    uint32_t hz = plls[0].con == 3 ? pll0_hz(d) : source_hz(d);

    hz /= (d->regs[CCLKCFG / 4] & 255) + 1;
    if (hz > chip.model->max_hz)
        chip_fault("core at %u Hz", hz);
    chip.core_hz = hz;
    check_flash(d, hz);
}

static void
check_pll1(struct device *d)
{
    uint32_t m = (plls[1].cfg & 31) + 1, p = 1u << (plls[1].cfg >> 5 & 3);
    uint32_t out = chip.hse_hz * m, cco = out * 2 * p;

    if (!(d->regs[SCS / 4] & OSCEN) || out != 48000000 || cco < 156000000
        || cco > 320000000)
        chip_fault("PLL1 with M %u, P %u: %u Hz for USB", m, p, out);
}

/* Two words in a row make the new settings count. */
static void
feed(struct device *d, uint32_t which, uint32_t value)
{
    struct pll *pll = &plls[which];
    uint32_t base = which ? PLL1CON : PLL0CON;
    uint32_t con = d->regs[base / 4] & 3, was = pll->con;

    if (value == 0xaa) {
        pll->fed = value;
        return;
    }
    if (value != 0x55 || pll->fed != 0xaa)
        chip_fault("PLL%u fed 0x%x", which, value);
    pll->fed = 0;
    if (was & 1 && con & 1 && pll->cfg != d->regs[base / 4 + 1])
        chip_fault("PLL%u changed while it is on", which);
    pll->cfg = d->regs[base / 4 + 1];
    if (con & 2 && !is_locked(pll))
        chip_fault("PLL%u connected before it has locked", which);
    if (con & 1 && !(was & 1))
        pll->locked_at = chip.cycle + LOCK_CYCLES;
    if (was & 2 && !(con & 1))
        chip_fault("PLL%u off while it is connected", which);
    pll->con = con;
    if (which == 0)
        update_core(d);
    else if (con & 2)
        check_pll1(d);
}

static uint32_t
syscon_read(struct device *d, uint32_t offset)
{
    switch (offset) {
    case PLL0STAT:
        return plls[0].cfg | plls[0].con << 24
            | (is_locked(&plls[0]) ? 1u << 26 : 0);
    case PLL1STAT:
        return plls[1].cfg | plls[1].con << 8
            | (is_locked(&plls[1]) ? 1u << 10 : 0);
    case SCS:
        return d->regs[SCS / 4]
            | (d->regs[SCS / 4] & OSCEN && chip.cycle >= osc_ready_at
               ? OSCSTAT : 0);
    default:
        return d->regs[offset / 4];
    }
}

static void
syscon_write(struct device *d, uint32_t offset, uint32_t value)
{
    uint32_t was = d->regs[offset / 4];

    d->regs[offset / 4] = value;
    switch (offset) {
    case PLL0FEED:
    case PLL1FEED:
        feed(d, offset == PLL1FEED, value);
        return;
    case SCS:
        if (value & OSCEN && !(was & OSCEN))
            osc_ready_at = chip.hse_hz ? chip.cycle + START_CYCLES : NEVER;
        return;
    case CLKSRCSEL:
        if (plls[0].con && value != was)
            chip_fault("clock source changed while PLL0 is on");
        update_core(d);
        return;
    case CCLKCFG:
    case FLASHCFG:
        update_core(d);
        return;
    case PCLKSEL0:
    case PCLKSEL1:
        if (value & (offset == PCLKSEL0 ? 0x000c0c00u : 0x03000300u))
            chip_fault("reserved bits of a PCLKSEL");
        if (plls[0].con && value != was)
            chip_fault("PCLKSEL changed while PLL0 is on");
        return;
    default:
        return;
    }
}

static void
syscon_reset(struct device *d)
{
    d->regs[FLASHCFG / 4] = 0x303a;
    d->regs[PCONP / 4] = 0x042887de;
    d->regs[USBINTST / 4] = 1u << 31;
    plls[0] = plls[1] = (struct pll) { 0, 0, 0, 0 };
    osc_ready_at = NEVER;
}

const struct device_ops lpc_syscon_ops = {
    syscon_reset, syscon_read, syscon_write, NULL,
};

bool
lpc_has_usb_clock(void)
{
    return plls[1].con == 3;
}

bool
lpc_has_clock(const struct device *d)
{
    return !d->info->gate_offset
        || bus_find(LPC_SYSCON, 0)->regs[PCONP / 4] & 1u << d->info->gate_bit;
}

uint32_t
lpc_divider(const struct device *d)
{
    static const uint8_t dividers[] = { 4, 1, 2, 8 };
    uint32_t field = d->info->bus;
    const uint32_t *regs = bus_find(LPC_SYSCON, 0)->regs;

    return dividers[regs[(PCLKSEL0 / 4) + field / 16] >> 2 * (field % 16) & 3];
}
