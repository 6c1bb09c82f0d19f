/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Pins of an LPC176x (UM10360, chapters 8 and 9).
 */
#include "unicorn_lpc.h"

enum { DIR = 0, MASK = 0x10, PIN = 0x14, SET = 0x18, CLR = 0x1c };
enum { PINMODE = 0x40 };

static uint32_t
read_field(uint32_t offset, uint32_t pin)
{
    const uint32_t *regs = bus_find(LPC_PINS, 0)->regs;

    return regs[offset / 4 + pin / 16] >> 2 * (pin % 16) & 3;
}

uint32_t
lpc_function_of(uint32_t pin)
{
    return read_field(0, pin);
}

/* Of those, pins that are plain pins */
static uint32_t
plain_pins(const struct device *d, uint32_t bits)
{
    uint32_t i;

    for (i = 0; i < 32; i++)
        if (bits >> i & 1 && lpc_function_of(d->info->index * 32u + i))
            bits &= ~(1u << i);
    return bits;
}

static void
update(struct device *d)
{
    bus_drive(d, d->regs[PIN / 4], plain_pins(d, d->regs[DIR / 4]));
}

/* What the pins show; a peripheral's input is seen as well. */
static uint32_t
read_pins(struct device *d)
{
    static const int8_t pulls[] = { 1, 0, 0, -1 };
    uint32_t bit, pins = d->out & d->driven;

    for (bit = 0; bit < 32; bit++) {
        uint32_t pin = d->info->index * 32u + bit;

        if (!(d->driven >> bit & 1)
            && chip.host.pin_in(chip.host.ctx, chip_now(), pin,
                                pulls[read_field(PINMODE, pin)]))
            pins |= 1u << bit;
    }
    return pins;
}

static uint32_t
gpio_read(struct device *d, uint32_t offset)
{
    if (offset == PIN)
        return read_pins(d) & ~d->regs[MASK / 4];
    return offset == SET ? d->regs[PIN / 4] : d->regs[offset / 4];
}

static void
gpio_write(struct device *d, uint32_t offset, uint32_t value)
{
    uint32_t *latch = &d->regs[PIN / 4], mask = d->regs[MASK / 4];

    if (offset == SET)
        *latch |= value & ~mask;
    else if (offset == CLR)
        *latch &= ~value | mask;
    else if (offset == PIN)
        *latch = (*latch & mask) | (value & ~mask);
    else
        d->regs[offset / 4] = value;
    update(d);
}

const struct device_ops lpc_gpio_ops = { NULL, gpio_read, gpio_write, NULL };

static void
pins_write(struct device *d, uint32_t offset, uint32_t value)
{
    uint8_t port;

    d->regs[offset / 4] = value;
    for (port = 0; port < 5; port++)
        update(bus_find(LPC_GPIO, port));
    lpc_update_pwm();
}

const struct device_ops lpc_pins_ops = { NULL, NULL, pins_write, NULL };
