/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * An RP2040 or RP2350: its bus with resets, clocks, timer, watchdog and pins
 * (data sheet, chapter 2 and 4.6, 4.7).  The other core and PIO:
 * unicorn_rp2040_core1.c.
 */
#include <stdlib.h>
#include <string.h>

#include "unicorn_rp2040.h"
#include "unicorn_rp2040_core1.h"
#include "unicorn_usbhost.h"

#define APB_BASE 0x40000000u
#define SIO_BASE 0xd0000000u
#define ROM_REQUEST 0x40fff000u /* the boot ROM of rp2040_flash.c writes here */
#define ROSC_HZ 6500000u
#define MAX_HZ 133000000u
#define ALL_RESETS 0x1fffffffu
/* Processors, SIO, memories, resets */
#define WDSEL_NEEDED (rp.is_2350 ? 0x01b7fd10u : 0x1c7f8u)
enum { RESET_TIMER = 21 };
enum { IRQ_TIMER = 16 };
/* Words */
enum { CLK_REF = 12, CLK_SYS = 15, CLK_PERI = 18 };
#define CLK_USB (rp.is_2350 ? 24u : 21u)
#define CLK_ADC (rp.is_2350 ? 27u : 24u)
enum { TIMER_TIMELR = 3, TIMER_ALARM0 = 4, TIMER_RAWH = 9, TIMER_RAWL = 10,
       TIMER_INTR = 13, TIMER_INTE = 14, TIMER_INTF = 15, TIMER_INTS = 16 };
enum { WD_CTRL = 0, WD_LOAD = 1, WD_TICK = 11 };
enum { SIO_IN = 1, SIO_OUT = 4, SIO_OE = 8, SIO_FIFO = 20 };

struct rp_state rp;

/* Bit in RESETS of each block, or -1 */
static const int8_t reset_bits[RP_N_BLOCKS] = {
    19, 18, -1, -1, -1, 5, 6, 8, 9, -1, 12, 13, 1, 22, 23, 16, 17, 3, 4, 0, 14,
    21, -1, 15, -1, -1, -1, -1,
};
static const int8_t reset_bits_2350[RP_N_BLOCKS] = {
    21, 20, -1, -1, -1, 6, 7, 9, 10, -1, 14, 15, 1, 26, 27, 18, 19, 4, 5, 0, 16,
    23, -1, -1, -1, -1, -1, -1,
};
/* Blocks of an RP2350, 32 KiB each, up to the one before USB */
static const uint8_t blocks_2350[] = {
    RP_SYSINFO, RP_SYSCFG, RP_CLOCKS, RP_PSM, RP_RESETS, RP_IO_BANK0,
    RP_IO_QSPI, RP_PADS_BANK0, RP_PADS_QSPI, RP_XOSC, RP_PLL_SYS, RP_PLL_USB,
    RP_N_BLOCKS, RP_N_BLOCKS, RP_UART0, RP_UART1, RP_SPI0, RP_SPI1, RP_I2C0,
    RP_I2C1, RP_ADC, RP_PWM, RP_TIMER, RP_N_BLOCKS, RP_N_BLOCKS, RP_N_BLOCKS,
    RP_N_BLOCKS, RP_WATCHDOG, RP_N_BLOCKS, RP_N_BLOCKS, RP_N_BLOCKS,
    RP_N_BLOCKS, RP_N_BLOCKS, RP_TICKS, RP_N_BLOCKS, RP_N_BLOCKS, RP_N_BLOCKS,
    RP_N_BLOCKS, RP_OTP,
};

uint32_t
rp_combine(uint32_t old, uint32_t value, uint32_t alias)
{
    switch (alias) {
    case 1:
        return old ^ value;
    case 2:
        return old | value;
    case 3:
        return old & ~value;
    default:
        return value;
    }
}

/*
 * Clocks
 */

static uint32_t
xosc_hz(void)
{
    if (chip.cycle < rp.xosc_ready || !chip.hse_hz)
        chip_fault("the crystal does not swing yet");
    return chip.hse_hz;
}

/* Output of a PLL: 0 the processor's, 1 of USB. */
static uint32_t
pll_hz(uint32_t index)
{
    const uint32_t *regs = rp.regs[RP_PLL_SYS + index];
    uint64_t vco = (uint64_t)xosc_hz() / (regs[0] & 63 ? regs[0] & 63 : 1)
        * regs[2];
    uint32_t div1 = regs[3] >> 16 & 7, div2 = regs[3] >> 12 & 7;

    if (chip.cycle < rp.pll_ready[index] || regs[1] & 0x29)
        chip_fault("PLL %u is used before it is on and locked", index);
    if (vco < 750000000 || vco > 1600000000 || !div1 || !div2) {
        chip_fault("PLL %u at %llu Hz", index, (unsigned long long)vco);
        return 1;
    }
    return (uint32_t)(vco / div1 / div2);
}

/* What a clock is made of: each has another order of its sources. */
static uint32_t
aux_hz(uint32_t word)
{
    uint32_t source = rp.regs[RP_CLOCKS][word] >> 5 & 7;

    if (word == CLK_PERI && source == 0)
        return chip.core_hz;
    source -= word == CLK_PERI;
    if (source > 1)
        return 0;
    return pll_hz(word == CLK_USB || word == CLK_ADC ? !source : source);
}

static void
update_clocks(void)
{
    const uint32_t *regs = rp.regs[RP_CLOCKS];

    rp.ref_hz = (regs[CLK_REF] & 3) == 2 ? xosc_hz() : ROSC_HZ;
    chip.core_hz = regs[CLK_SYS] & 1 ? aux_hz(CLK_SYS) : rp.ref_hz;
    if (!chip.core_hz || chip.core_hz > (rp.is_2350 ? 150000000u : MAX_HZ))
        chip_fault("core at %u Hz", chip.core_hz);
    rp.peri_hz = regs[CLK_PERI] & 0x800 ? aux_hz(CLK_PERI) : 0;
    rp.usb_hz = regs[CLK_USB] & 0x800 ? aux_hz(CLK_USB) : 0;
    rp.adc_hz = regs[CLK_ADC] & 0x800 ? aux_hz(CLK_ADC) : 0;
}

static void
clock_write(uint32_t word, uint32_t value)
{
    if (word % 3 == 2)
        return;
    if (word % 3 == 1 && value != (rp.is_2350 ? 0x10000u : 0x100u))
        chip_fault("dividers of clocks are not modelled");
    rp.regs[RP_CLOCKS][word] = value;
    update_clocks();
}

static uint32_t
clock_read(uint32_t word)
{
    if (word == CLK_REF + 2 || word == CLK_SYS + 2)
        return 1u << (rp.regs[RP_CLOCKS][word - 2] & 3);
    return rp.regs[RP_CLOCKS][word];
}

/* The crystal needs a millisecond, a PLL 100 us. */
static void
xosc_write(uint32_t word, uint32_t value)
{
    bool was_on = (rp.regs[RP_XOSC][0] >> 12 & 0xfff) == 0xfab;
    uint64_t us = rp.regs[RP_XOSC][3] * 256ull * 1000000 / 12000000;

    rp.regs[RP_XOSC][word] = value;
    if (word != 0 || was_on || (value >> 12 & 0xfff) != 0xfab)
        return;
    if (us < 1000)
        chip_fault("the crystal gets %u us to start", (unsigned)us);
    rp.xosc_ready = chip.cycle + us * chip.core_hz / 1000000;
}

static void
pll_write(uint32_t index, uint32_t word, uint32_t value)
{
    uint32_t *regs = rp.regs[RP_PLL_SYS + index];
    bool was_on = !(regs[1] & 0x21);

    if (was_on && word >= 2 && regs[word] != value && word == 2)
        chip_fault("PLL %u is changed while it runs", index);
    regs[word] = value;
    if (!was_on && !(regs[1] & 0x21))
        rp.pll_ready[index] = chip.cycle + chip.core_hz / 10000;
}

static uint32_t
pll_read(uint32_t index, uint32_t word)
{
    uint32_t value = rp.regs[RP_PLL_SYS + index][word];

    if (word == 0 && !(rp.regs[RP_PLL_SYS + index][1] & 0x21)
        && chip.cycle >= rp.pll_ready[index])
        value |= 1u << 31;
    return value;
}

/*
 * Timer and watchdog: both count ticks that the watchdog makes
 */

static uint64_t
ticks_of(uint64_t cycle)
{
    return cycle * chip.tick_mul / chip.tick_div;
}

static uint64_t
read_timer(void)
{
    if (!chip.is_counting)
        chip_fault("the timer has no ticks");
    return ticks_of(chip.cycle) - ticks_of(chip.cyccnt_zero);
}

static void
update_timer_irq(void)
{
    const uint32_t *regs = rp.regs[RP_TIMER];

    core_set_level(IRQ_TIMER, ((regs[TIMER_INTR] & regs[TIMER_INTE])
                               | regs[TIMER_INTF]) & 1);
}

/* The first cycle of the tick that an alarm names: in an hour and a half if it
 * has just passed. */
static void
set_alarm(uint32_t alarm)
{
    uint64_t now = read_timer(), tick;
    uint32_t ahead = alarm - (uint32_t)now;

    tick = now + (ahead ? ahead : 1ull << 32) + ticks_of(chip.cyccnt_zero);
    rp.alarm_due = (tick * chip.tick_div + chip.tick_mul - 1) / chip.tick_mul;
    chip_wake_at(rp.alarm_due);
}

static void
timer_write_word(uint32_t word, uint32_t value)
{
    if (word == TIMER_INTR) {
        rp.regs[RP_TIMER][word] &= ~value;
    } else {
        rp.regs[RP_TIMER][word] = value;
        if (word == TIMER_ALARM0)
            set_alarm(value);
    }
    update_timer_irq();
}

static uint32_t
timer_read_word(uint32_t word)
{
    if (word == TIMER_RAWL || word == TIMER_TIMELR)
        return (uint32_t)read_timer();
    if (word == TIMER_RAWH)
        return (uint32_t)(read_timer() >> 32);
    return rp.regs[RP_TIMER][word];
}

/* Ticks begin when both the watchdog makes them and the timer is there. */
static void
try_start_ticks(void)
{
    uint32_t tick = rp.regs[RP_WATCHDOG][WD_TICK];
    uint64_t a, b, t;

    if (rp.is_2350 || !(tick & 0x200) || rp_in_reset(RESET_TIMER)
        || chip.is_counting)
        return;
    if (!(tick & 0x1ff)) {
        chip_fault("no cycles to a tick");
        return;
    }
    chip.tick_mul = rp.ref_hz / (tick & 0x1ff);
    chip.tick_div = chip.core_hz;
    for (a = chip.tick_div, b = chip.tick_mul; b; t = a % b, a = b, b = t)
        ;
    chip.tick_mul /= a;
    chip.tick_div /= a;
    chip.cyccnt_zero = chip.cycle;
    chip.is_counting = true;
    chip_wake_at(chip.cycle);
}

/* What the watchdog has been loaded with: ticks of its own or, twice each
 * (erratum RP2040-E1), of the timer. */
static uint64_t
watchdog_cycles(void)
{
    uint64_t load = rp.regs[RP_WATCHDOG][WD_LOAD] & 0xffffff;
    const uint32_t *tick = &rp.regs[RP_TICKS][12];

    if (!rp.is_2350)
        return load / 2 * chip.tick_div / chip.tick_mul;
    if (!(tick[0] & 1) || !tick[1])
        chip_fault("the watchdog has no ticks");
    return load * (tick[1] ? tick[1] : 1) * chip.core_hz / rp.ref_hz;
}

static void
watchdog_write(uint32_t word, uint32_t value)
{
    uint32_t *regs = rp.regs[RP_WATCHDOG];

    if (word == WD_CTRL && value & (1u << 31)) {
        if ((rp.regs[RP_PSM][2] & WDSEL_NEEDED) != WDSEL_NEEDED)
            chip_fault("the watchdog resets parts of the chip only");
        chip.wants_reset = true;
        chip_wake_at(chip.cycle);
    }
    regs[word] = value;
    if (word == WD_TICK)
        try_start_ticks();
    if (word != WD_LOAD && word != WD_CTRL)
        return;
    rp.watchdog_due = NEVER;
    if (regs[WD_CTRL] & (1u << 30)) {
        if ((rp.regs[RP_PSM][2] & WDSEL_NEEDED) != WDSEL_NEEDED)
            chip_fault("the watchdog resets parts of the chip only");
        rp.watchdog_due = chip.cycle + watchdog_cycles();
        chip_wake_at(rp.watchdog_due);
    }
}

/*
 * Pins
 */

/* Not cut off, nor switched off. */
static uint64_t
driven_pins(void)
{
    uint64_t driven = 0;
    uint32_t pin;

    for (pin = 0; pin < rp.n_pins; pin++)
        if (rp.oe >> pin & 1 && rp_function(pin) == RP_FUNC_SIO
            && !(rp.regs[RP_PADS_BANK0][1 + pin] & 0x180))
            driven |= 1ull << pin;
    return driven;
}

/* Tell the world what outputs have changed. */
static void
update_outputs(void)
{
    uint64_t changed = (rp.told_out ^ rp.out) & rp.told_driven;

    rp.told_out ^= changed;
    while (changed) {
        uint32_t bit = (uint32_t)__builtin_ctzll(changed);

        changed &= changed - 1;
        chip.host.pin_out(chip.host.ctx, chip_now(), bit, (rp.out >> bit) & 1);
    }
}

/* What is an output now shows its level. */
static void
update_modes(void)
{
    uint64_t driven = driven_pins(), fresh = driven & ~rp.told_driven;

    rp.told_driven = driven;
    rp.told_out = (rp.told_out & ~fresh) | (~rp.out & fresh);
    update_outputs();
    rp_pwm_update();
}

static uint64_t
read_inputs(void)
{
    uint64_t in = rp.told_out & rp.told_driven;
    uint32_t pin;

    for (pin = 0; pin < rp.n_pins; pin++) {
        uint32_t pad = rp.regs[RP_PADS_BANK0][1 + pin];
        int8_t pull = pad & 8 ? 1 : pad & 4 ? -1 : 0;

        if (rp.told_driven >> pin & 1 || (pad & 0x140) != 0x40
            || rp_function(pin) != RP_FUNC_SIO)
            continue;
        if (chip.host.pin_in(chip.host.ctx, chip_now(), pin, pull))
            in |= 1ull << pin;
    }
    return in;
}

static uint64_t
sio_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    uint32_t word = (uint32_t)offset / 4;
    uint32_t bank = rp.is_2350 && word & 1 ? 32 : 0;

    (void)uc;
    (void)size;
    (void)param;
    if (word >= SIO_FIFO && word < SIO_FIFO + 3)
        return core1_fifo_read(word);
    if (word == SIO_IN || word == SIO_IN + 1)
        return (uint32_t)(read_inputs() >> (word == SIO_IN ? 0 : 32));
    if (rp.is_2350)
        word = SIO_OUT + (word - SIO_OUT) / 2;
    return (uint32_t)((word >= SIO_OE ? rp.oe : word >= SIO_OUT ? rp.out : 0)
                      >> bank);
}

/* Levels or directions of one bank: set, set bits, clear, invert. */
static uint64_t
change_bank(uint64_t old, uint32_t value, uint32_t alias, uint32_t bank)
{
    uint64_t fresh = rp_combine((uint32_t)(old >> bank), value, alias);

    return (old & ~(0xffffffffull << bank)) | fresh << bank;
}

/* An RP2350 has the banks in turns. */
static void
sio_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
          void *param)
{
    static const uint8_t aliases[] = { 0, 2, 3, 1 };
    uint32_t word = (uint32_t)offset / 4, bank = 0, alias;

    (void)uc;
    (void)size;
    (void)param;
    if (word >= SIO_FIFO && word < SIO_FIFO + 3) {
        core1_fifo_write(word, (uint32_t)value);
        return;
    }
    if (rp.is_2350) {
        bank = word & 1 ? 32 : 0;
        word = SIO_OUT + (word - SIO_OUT) / 2;
    }
    alias = aliases[word % 4];
    if (word >= SIO_OUT && word < SIO_OE) {
        rp.out = change_bank(rp.out, (uint32_t)value, alias, bank);
        update_outputs();
    } else if (word >= SIO_OE && word < SIO_OE + 4) {
        rp.oe = change_bank(rp.oe, (uint32_t)value, alias, bank);
        update_modes();
    }
}

/*
 * The bus
 */

/* The block at an address, with its reset checked. */
static uint32_t
find_block(uint32_t offset)
{
    uint32_t block = offset >> 14;
    const int8_t *bits = rp.is_2350 ? reset_bits_2350 : reset_bits;

    if (rp.is_2350)
        block = offset >> 15 < sizeof(blocks_2350) ? blocks_2350[offset >> 15]
            : RP_N_BLOCKS;
    if (block >= RP_N_BLOCKS || (offset & 0xfff) / 4 >= 160)
        chip_fault("nothing is modelled at 0x%08x", APB_BASE + offset);
    else if (bits[block] >= 0 && rp_in_reset((uint32_t)bits[block]))
        chip_fault("0x%08x is held in reset", APB_BASE + offset);
    return chip.is_broken ? RP_N_BLOCKS : block;
}

static uint32_t
read_word(uint32_t block, uint32_t word)
{
    switch (block) {
    case RP_CLOCKS:
        return clock_read(word);
    case RP_RESETS:
        return word == 2 ? ~rp.regs[block][0] & ALL_RESETS
            : rp.regs[block][word];
    case RP_XOSC:
        return word == 1 ? (chip.cycle >= rp.xosc_ready ? 1u << 31 : 0)
            : rp.regs[block][word];
    case RP_PLL_SYS:
    case RP_PLL_USB:
        return pll_read(block - RP_PLL_SYS, word);
    case RP_TIMER:
        return timer_read_word(word);
    case RP_UART0: case RP_UART1: case RP_SPI0: case RP_SPI1:
    case RP_I2C0: case RP_I2C1: case RP_ADC:
        return rp_io_read(block, word);
    default:
        return rp.regs[block][word];
    }
}

static void
write_word(uint32_t block, uint32_t word, uint32_t value)
{
    switch (block) {
    case RP_CLOCKS:
        clock_write(word, value);
        return;
    case RP_XOSC:
        xosc_write(word, value);
        return;
    case RP_PLL_SYS:
    case RP_PLL_USB:
        pll_write(block - RP_PLL_SYS, word, value);
        return;
    case RP_TIMER:
        timer_write_word(word, value);
        return;
    case RP_WATCHDOG:
        watchdog_write(word, value);
        return;
    case RP_UART0: case RP_UART1: case RP_SPI0: case RP_SPI1:
    case RP_I2C0: case RP_I2C1: case RP_ADC: case RP_PWM:
        rp_io_write(block, word, value);
        return;
    case RP_RESETS:
        rp.regs[block][word] = value & ALL_RESETS;
        try_start_ticks();
        return;
    case RP_IO_BANK0:
    case RP_PADS_BANK0:
        rp.regs[block][word] = value;
        update_modes();
        return;
    default:
        rp.regs[block][word] = value;
    }
}

static uint64_t
apb_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    uint32_t block = find_block((uint32_t)offset);

    (void)uc;
    (void)param;
    if (block == RP_N_BLOCKS)
        return 0;
    return read_word(block, (uint32_t)(offset & 0xfff) / 4)
        >> 8 * (offset & 3) & (size == 4 ? UINT32_MAX : (1u << 8 * size) - 1);
}

static void
apb_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
          void *param)
{
    uint32_t alias = (uint32_t)offset >> 12 & 3, block, word;

    (void)uc;
    (void)param;
    if (offset == ROM_REQUEST - APB_BASE) {
        /* an RP2350 is told what to do: boot from USB */
        if (rp.is_2350 && (value & 15) != 2)
            chip_fault("the boot ROM is asked for 0x%x", (uint32_t)value);
        chip.wants_bootloader = chip.wants_reset = true;
        chip_wake_at(chip.cycle);
        return;
    }
    block = find_block((uint32_t)offset);
    if (block == RP_N_BLOCKS)
        return;
    if (size != 4) {
        chip_fault("%u bytes written to 0x%08x", size,
                   APB_BASE + (uint32_t)offset);
        return;
    }
    word = (uint32_t)(offset & 0xfff) / 4;
    /* what a plain register holds is what the other addresses change */
    if (alias)
        value = rp_combine(rp.regs[block][word], (uint32_t)value, alias);
    write_word(block, word, (uint32_t)value);
}

static void
rp_map(uc_engine *uc)
{
    if (uc_mmio_map(uc, APB_BASE, 0x1000000, apb_read, NULL, apb_write, NULL)
        || uc_mmio_map(uc, SIO_BASE, 0x1000, sio_read, NULL, sio_write, NULL))
        chip_fault("no peripherals");
    rp_flash_map(uc);
    rp_usb_map(uc);
    core1_map(uc);
}

/* What differs; the boot ROM has used the flash chip's pins. */
static void
set_chip(void)
{
    bool new = !strcmp(chip.model->name, "rp2350");

    rp.is_2350 = new;
    rp.n_pins = new ? 48 : 30;
    rp.usb_irq = 16 + (new ? 14 : 5);
    rp.uart_irq = 16 + (new ? 33 : 20);
    rp.usb_reset = new ? 28 : 24;
    rp.pwm_reset = new ? 16 : 14;
    rp.regs[RP_RESETS][0] = ALL_RESETS
        & ~(new ? 1u << 7 | 1u << 10 : 1u << 6 | 1u << 9);
    rp.regs[RP_OTP][0] = 0x44332211;
    rp.regs[RP_OTP][1] = 0x88776655;
}

static void
rp_reset(void)
{
    uint32_t pin;

    memset(&rp, 0, sizeof(rp));
    set_chip();
    rp.alarm_due = rp.watchdog_due = rp.adc_due = NEVER;
    rp.xosc_ready = rp.pll_ready[0] = rp.pll_ready[1] = NEVER;
    rp.regs[RP_PLL_SYS][1] = rp.regs[RP_PLL_USB][1] = 0x2d;
    for (pin = 0; pin < rp.n_pins; pin++) {
        rp.regs[RP_IO_BANK0][2 * pin + 1] = 31;
        rp.regs[RP_PADS_BANK0][1 + pin] = rp.is_2350 ? 0x116 : 0x56;
    }
    rp.ref_hz = chip.core_hz = ROSC_HZ;
    rp_io_reset();
    rp_usb_reset();
    core1_reset();
}

static void
rp_run_events(void)
{
    if (chip.cycle >= rp.alarm_due) {
        rp.alarm_due = NEVER;
        rp.regs[RP_TIMER][TIMER_INTR] |= 1;
        update_timer_irq();
    }
    if (chip.cycle >= rp.watchdog_due) {
        rp.watchdog_due = NEVER;
        chip.wants_reset = true;
    }
    rp_io_run_events();
    core1_run_events();
    usbhost_run_events();
}

static uint64_t
least(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

static uint64_t
rp_next_event(void)
{
    return least(least(rp.alarm_due, rp.watchdog_due),
                 least(core1_next_event(),
                       least(rp_io_next_event(), usbhost_next_event())));
}

/* The console is on the UART or on USB. */
static uint64_t
rp_rx_free_at(void)
{
    return rp_usb_is_on() ? usbhost_free_at() : rp_uart_free_at();
}

static void
rp_rx(uint8_t byte)
{
    if (rp_usb_is_on())
        usbhost_rx(byte);
    else
        rp_uart_rx(byte);
}

static int32_t
rp_find_pin(const char *name)
{
    char *end;
    long pin;

    if (strncmp(name, "gpio", 4) || !name[4])
        return -1;
    pin = strtol(name + 4, &end, 10);
    return *end || pin < 0 || pin >= (long)rp.n_pins ? -1 : (int32_t)pin;
}

static const struct family rp2040_family = {
    .flash_base = 0x10000000, .maps_flash = true, .timer_vector = IRQ_TIMER,
    .map = rp_map, .reset = rp_reset, .boot = rp_flash_boot,
    .run_events = rp_run_events, .next_event = rp_next_event,
    .rx_free_at = rp_rx_free_at, .rx = rp_rx, .find_pin = rp_find_pin,
};

static const struct family rp2350_family = {
    .flash_base = 0x10000000, .maps_flash = true,
    .map = rp_map, .reset = rp_reset, .boot = rp_flash_boot,
    .run_events = rp_run_events, .next_event = rp_next_event,
    .rx_free_at = rp_rx_free_at, .rx = rp_rx, .find_pin = rp_find_pin,
};

const struct chip_model rp2040_models[] = {
    { .name = "rp2040", .family = &rp2040_family, .cpu = UC_CPU_ARM_CORTEX_M0,
      .flash_size = 0x200000, .ram_base = 0x20000000, .ram_size = 0x42000,
      .max_hz = 12000000 },
    { .name = "rp2350", .family = &rp2350_family, .cpu = UC_CPU_ARM_CORTEX_M33,
      .flash_size = 0x200000, .ram_base = 0x20000000, .ram_size = 0x82000,
      .max_hz = 150000000 },
    { .name = NULL },
};
