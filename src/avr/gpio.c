/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins: number = 8 * letter of the port + bit. */
#include "board/gpio.h"
#include "board/mem.h"
#include "core/sched.h"

DECL_ENUMERATION_RANGE("pin", "PA0", 0, 8);
DECL_ENUMERATION_RANGE("pin", "PB0", 8, 8);
DECL_ENUMERATION_RANGE("pin", "PC0", 16, 8);
DECL_ENUMERATION_RANGE("pin", "PD0", 24, 8);
#if CONFIG_MACH_atmega2560
DECL_ENUMERATION_RANGE("pin", "PE0", 32, 8);
DECL_ENUMERATION_RANGE("pin", "PF0", 40, 8);
DECL_ENUMERATION_RANGE("pin", "PG0", 48, 6);
DECL_ENUMERATION_RANGE("pin", "PH0", 56, 8);
DECL_ENUMERATION_RANGE("pin", "PJ0", 72, 8);
DECL_ENUMERATION_RANGE("pin", "PK0", 80, 8);
DECL_ENUMERATION_RANGE("pin", "PL0", 88, 8);
#endif

static volatile uint8_t *const ROM ports[] = {
    &PINA, &PINB, &PINC, &PIND,
#if CONFIG_MACH_atmega2560
    &PINE, &PINF, &PING, &PINH, 0, &PINJ, &PINK, &PINL,
#endif
};
#define N_PORTS (sizeof(ports) / sizeof(ports[0]))

/* NULL without such a pin. */
static volatile uint8_t *find_port(uint32_t pin)
{
    return pin < 8 * N_PORTS ? ports[pin / 8] : 0;
}

struct gpio_out gpio_setup_output(uint32_t pin, uint8_t level)
{
    struct gpio_out out = { find_port(pin), (uint8_t)(1 << (pin % 8)) };

    if (!out.port)
        shutdown("Not an output pin");
    gpio_drive(out, level);
    return out;
}

void gpio_drive(struct gpio_out out, uint8_t level)
{
    irq_flag_t flag = irq_save();

    gpio_write(out, level);
    out.port[1] |= out.bit;
    irq_restore(flag);
}

struct gpio_in gpio_setup_input(uint32_t pin, int8_t pull)
{
    struct gpio_in in = { find_port(pin), (uint8_t)(1 << (pin % 8)) };

    if (!in.port || pull < 0)
        shutdown("Not a valid input pin");
    gpio_float(in, pull);
    return in;
}

void gpio_float(struct gpio_in in, int8_t pull)
{
    irq_flag_t flag = irq_save();

    in.port[1] &= (uint8_t)~in.bit;
    gpio_write((struct gpio_out) { in.port, in.bit }, pull > 0);
    irq_restore(flag);
}
