/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * UART, pwm and watchdogs of SAM3X, SAM4 and SAM E70 (11057, chapters 34, 38,
 * 15).
 */
#include <string.h>

#include "unicorn_sam.h"

/*
 * UART
 */

enum { CR = 0, MR = 4, IER = 8, IDR = 0xc, IMR = 0x10, SR = 0x14, RHR = 0x18,
       THR = 0x1c, BRGR = 0x20 };
enum { RXRDY = 1, TXRDY = 2, OVRE = 0x20, TXEMPTY = 0x200 };
enum { RXEN = 1 << 4, RXDIS = 1 << 5, TXEN = 1 << 6, TXDIS = 1 << 7,
       RSTSTA = 1 << 8 };

/* Inputs: pin and peripheral, by line and index of the UART */
static const struct {
    uint8_t line, uart, pin, function;
} inputs[] = {
    { SAM3X, 0, 8, 0 }, { SAM4S, 0, 9, 0 }, { SAM4S, 1, 34, 0 },
    { SAM4E, 0, 9, 0 }, { SAM4E, 1, 5, 2 }, { SAME70, 0, 9, 0 },
    { SAME70, 2, 121, 2 },
};

static bool
is_connected(const struct device *d)
{
    uint32_t i;

    for (i = 0; i < sizeof(inputs) / sizeof(inputs[0]); i++)
        if (inputs[i].line == sam_line()
            && inputs[i].uart == d->info->index)
            return sam_function_of(inputs[i].pin) == inputs[i].function
                && sam_function_of(inputs[i].pin + 1u) == inputs[i].function;
    return false;
}

static void
update_irq(struct device *d)
{
    core_set_pending(16u + d->info->irq,
                     d->regs[SR / 4] & d->regs[IMR / 4]);
}

static uint64_t
byte_cycles(struct device *d)
{
    if (!d->regs[BRGR / 4] || !is_connected(d) || d->regs[MR / 4] != 0x800) {
        chip_fault("uart without divider or pins, or with parity");
        return 0;
    }
    return bus_byte_cycles((double)chip.bus_hz[1] / 16 / d->regs[BRGR / 4]);
}

static void
start_tx(struct device *d)
{
    if (!d->has_tdr || d->due != NEVER)
        return;
    if (!(d->regs[CR / 4] & TXEN))
        chip_fault("uart sends while that is off");
    d->shift = d->regs[THR / 4];
    d->has_tdr = false;
    d->regs[SR / 4] |= TXRDY;
    bus_plan(d, byte_cycles(d));
}

static void
uart_event(struct device *d)
{
    uint8_t byte = (uint8_t)d->shift;

    chip.host.tx(chip.host.ctx, chip_now(), &byte, 1);
    start_tx(d);
    if (d->due == NEVER)
        d->regs[SR / 4] |= TXEMPTY;
    update_irq(d);
}

/* CR holds here what is enabled. */
static void
write_control(struct device *d, uint32_t value)
{
    d->regs[CR / 4] |= value & (RXEN | TXEN);
    if (value & RXDIS)
        d->regs[CR / 4] &= ~(uint32_t)RXEN;
    if (value & TXDIS)
        d->regs[CR / 4] &= ~(uint32_t)TXEN;
    if (value & RSTSTA)
        d->regs[SR / 4] &= ~(uint32_t)OVRE;
    if (value & TXEN)
        d->regs[SR / 4] |= TXRDY | TXEMPTY;
    if (value & RXEN)
        chip.console = d;
}

static void
uart_write(struct device *d, uint32_t offset, uint32_t value)
{
    if (offset == CR) {
        write_control(d, value);
    } else if (offset == IER) {
        d->regs[IMR / 4] |= value;
    } else if (offset == IDR) {
        d->regs[IMR / 4] &= ~value;
    } else if (offset == THR) {
        if (!(d->regs[SR / 4] & TXRDY))
            chip_fault("uart written while it is full");
        d->regs[THR / 4] = value;
        d->regs[SR / 4] &= ~(uint32_t)(TXRDY | TXEMPTY);
        d->has_tdr = true;
        start_tx(d);
    } else {
        d->regs[offset / 4] = value;
    }
    update_irq(d);
}

static uint32_t
uart_read(struct device *d, uint32_t offset)
{
    if (offset == RHR) {
        d->regs[SR / 4] &= ~(uint32_t)RXRDY;
        update_irq(d);
    }
    return d->regs[offset / 4];
}

const struct device_ops sam_uart_ops = {
    NULL, uart_read, uart_write, uart_event,
};

void
sam_rx(uint8_t byte)
{
    struct device *d = chip.console;
    uint64_t cycles = byte_cycles(d);

    if (!cycles)
        return;
    d->next_rx = chip.cycle + cycles;
    if (d->regs[SR / 4] & RXRDY)
        d->regs[SR / 4] |= OVRE;
    d->regs[RHR / 4] = byte;
    d->regs[SR / 4] |= RXRDY;
    update_irq(d);
}

/*
 * Pwm
 */

enum { ENA = 4, DIS = 8, PWM_SR = 0xc, CHANNELS = 0x200, CPOL = 1 << 9 };
enum { CMR = 0, CDTY = 4, CDTYUPD = 8, CPRD = 0xc, CPRDUPD = 0x10 };

/* Pins that the tests look at: unit and channel; does it begin high? */
static const struct {
    uint8_t line, pin, function, unit, channel;
    bool is_high;
} pwm_pins[] = {
    { SAM3X, 49, 1, 0, 1, false }, { SAM3X, 87, 1, 0, 6, false },
    { SAM3X, 82, 1, 0, 6, true },
    { SAM4S, 86, 1, 0, 3, false }, { SAM4S, 84, 1, 0, 2, true },
    { SAM4E, 86, 1, 0, 3, false }, { SAM4E, 84, 1, 0, 2, true },
    { SAME70, 96, 1, 1, 0, false }, { SAME70, 83, 1, 0, 2, true },
};
enum { N_PWM_PINS = sizeof(pwm_pins) / sizeof(pwm_pins[0]) };
static uint32_t pwm_told[N_PWM_PINS][3];

/* A channel's counts as {cycle, on, whole} of a pin. */
static void
find_cycle(const uint32_t *channel, bool is_high, uint32_t *now)
{
    uint32_t duty = channel[CDTY / 4], period = channel[CPRD / 4];
    bool starts_high = channel[CMR / 4] & CPOL;

    if (duty > period || period > 65535 || (channel[CMR / 4] & 15) > 10)
        chip_fault("pwm with %u of %u counts", duty, period);
    now[0] = (period << (channel[CMR / 4] & 15)) * sam_divider();
    now[1] = starts_high == is_high ? duty : period - duty;
    now[2] = period;
}

void
sam_update_pwm(void)
{
    uint32_t i, now[3];

    for (i = 0; i < N_PWM_PINS; i++) {
        const struct device *d = bus_find(SAM_PWM, pwm_pins[i].unit);
        uint32_t channel = pwm_pins[i].channel;

        if (pwm_pins[i].line != sam_line() || !d
            || sam_function_of(pwm_pins[i].pin) != pwm_pins[i].function
            || !(d->regs[PWM_SR / 4] & 1u << channel))
            continue;
        find_cycle(&d->regs[(CHANNELS + 0x20 * channel) / 4],
                   pwm_pins[i].is_high, now);
        if (!memcmp(pwm_told[i], now, sizeof(now)))
            continue;
        memcpy(pwm_told[i], now, sizeof(now));
        chip.host.pwm_out(chip.host.ctx, chip_now(), pwm_pins[i].pin, now[0],
                          now[1], now[2]);
    }
}

/* What is to come is there at once: the model does not count. */
static void
pwm_write(struct device *d, uint32_t offset, uint32_t value)
{
    uint32_t in_channel = offset & 0x1f;

    if (offset == ENA) {
        d->regs[PWM_SR / 4] |= value;
    } else if (offset == DIS) {
        d->regs[PWM_SR / 4] &= ~value;
    } else if (offset >= CHANNELS
               && (in_channel == CDTYUPD || in_channel == CPRDUPD)) {
        d->regs[offset / 4 - 1] = value;
    } else {
        if (offset >= CHANNELS
            && d->regs[PWM_SR / 4] & 1u << (offset - CHANNELS) / 32)
            chip_fault("pwm channel changed while it is on");
        d->regs[offset / 4] = value;
    }
    sam_update_pwm();
}

static void
pwm_reset(struct device *d)
{
    (void)d;
    memset(pwm_told, 0, sizeof(pwm_told));
}

const struct device_ops sam_pwm_ops = { pwm_reset, NULL, pwm_write, NULL };

/*
 * Watchdogs: from reset on, with 16 s; their mode is written once
 */

enum { WDT_CR = 0, WDT_MR = 4, WDDIS = 1 << 15, WDRSTEN = 1 << 13,
       SLOW_HZ = 32768 };

static void
restart(struct device *d)
{
    uint32_t mode = d->regs[WDT_MR / 4];

    d->due = NEVER;
    if (!(mode & WDDIS) && mode & WDRSTEN)
        bus_plan(d, (uint64_t)(mode & 0xfff) * 128 * chip.core_hz / SLOW_HZ);
}

static void
wdt_write(struct device *d, uint32_t offset, uint32_t value)
{
    if (offset == WDT_CR && value >> 24 != 0xa5 && d->info->kind == SAM_WDT)
        chip_fault("watchdog without its key");
    if (offset == WDT_MR) {
        if (d->shift)
            chip_fault("a watchdog's mode is written twice");
        d->shift = 1;
        d->regs[WDT_MR / 4] = value;
    }
    restart(d);
}

static void
wdt_event(struct device *d)
{
    (void)d;
    chip.wants_reset = true;
}

static void
wdt_reset(struct device *d)
{
    d->regs[WDT_MR / 4] = 0x3fff2fff;
    restart(d);
}

const struct device_ops sam_wdt_ops = {
    wdt_reset, NULL, wdt_write, wdt_event,
};
const struct device_ops sam_rswdt_ops = {
    wdt_reset, NULL, wdt_write, wdt_event,
};
