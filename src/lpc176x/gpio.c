/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins: number = 32 * port + bit (UM10360, chapters 8 and 9). */
#include "board/gpio.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"

DECL_ENUMERATION_RANGE("pin", "P0.0", 0, 32);
DECL_ENUMERATION_RANGE("pin", "P1.0", 32, 32);
DECL_ENUMERATION_RANGE("pin", "P2.0", 64, 32);
DECL_ENUMERATION_RANGE("pin", "P3.0", 96, 32);
DECL_ENUMERATION_RANGE("pin", "P4.0", 128, 32);

/* Bits that have a pin, of the package with 100 */
static const uint32_t port_bits[] = {
    0x7fff8fff, 0xffffc713, 0x00003fff, 0x06000000, 0x30000000,
};
#define N_PORTS (sizeof(port_bits) / sizeof(port_bits[0]))

/* The port's registers; NULL without such a pin. */
static struct gpio_regs *find_port(uint32_t pin)
{
    uint32_t port = pin / 32;

    if (port >= N_PORTS || !(port_bits[port] & (1u << (pin % 32))))
        return NULL;
    return (struct gpio_regs *)(GPIO_BASE + 0x20 * port);
}

static void set_field(volatile uint32_t *regs, uint32_t pin, uint32_t value)
{
    uint32_t shift = 2 * (pin % 16);

    regs[pin / 16] = (regs[pin / 16] & ~(3u << shift)) | value << shift;
}

/* Irqs off.  P0.27 to P0.30 have no pulls: a board that needs one there brings
 * it. */
static void set_function(uint32_t pin, uint8_t function, int8_t pull)
{
    volatile uint32_t *open_drain = &PINCONNECT->PINMODE_OD[pin / 32];
    uint32_t bit = 1u << (pin % 32);

    set_field(PINCONNECT->PINMODE, pin, pull > 0 ? PINMODE_UP
              : pull < 0 ? PINMODE_DOWN : PINMODE_NONE);
    if (function & GPIO_OPEN_DRAIN)
        *open_drain |= bit;
    else
        *open_drain &= ~bit;
    set_field(PINCONNECT->PINSEL, pin, function & 3);
}

/* Number of the pin of a handle */
static uint32_t pin_of(const struct gpio_regs *regs, uint32_t bit)
{
    return ((uint32_t)regs - GPIO_BASE) + (uint32_t)__builtin_ctz(bit);
}

struct gpio_out gpio_setup_output(uint32_t pin, uint8_t level)
{
    struct gpio_out out = { find_port(pin), 1u << (pin % 32) };

    if (!out.regs)
        shutdown("Not an output pin");
    gpio_drive(out, level);
    return out;
}

void gpio_drive(struct gpio_out out, uint8_t level)
{
    irq_flag_t flag = irq_save();

    gpio_write(out, level);
    out.regs->DIR |= out.bit;
    set_function(pin_of(out.regs, out.bit), 0, 0);
    irq_restore(flag);
}

struct gpio_in gpio_setup_input(uint32_t pin, int8_t pull)
{
    struct gpio_in in = { find_port(pin), 1u << (pin % 32) };

    if (!in.regs)
        shutdown("Not a valid input pin");
    gpio_float(in, pull);
    return in;
}

void gpio_float(struct gpio_in in, int8_t pull)
{
    irq_flag_t flag = irq_save();

    set_function(pin_of(in.regs, in.bit), 0, pull);
    in.regs->DIR &= ~in.bit;
    irq_restore(flag);
}

void gpio_alternate(uint32_t pin, uint8_t function, int8_t pull)
{
    irq_flag_t flag = irq_save();

    set_function(pin, function, pull);
    irq_restore(flag);
}
