/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins: number = 8 * letter of the port + bit. */
#include "board/gpio.h"
#include "board/mem.h"
#include "core/sched.h"

#if !CONFIG_AVR_X8 && !CONFIG_AVR_U4
DECL_ENUMERATION_RANGE("pin", "PA0", PIN_NUMBER('A', 0), 8);
#endif
DECL_ENUMERATION_RANGE("pin", "PB0", PIN_NUMBER('B', 0), 8);
#if CONFIG_AVR_U4
DECL_ENUMERATION_RANGE("pin", "PC6", PIN_NUMBER('C', 6), 2);
#else
DECL_ENUMERATION_RANGE("pin", "PC0", PIN_NUMBER('C', 0), 8);
#endif
DECL_ENUMERATION_RANGE("pin", "PD0", PIN_NUMBER('D', 0), 8);
#if CONFIG_AVR_MEGA || CONFIG_AVR_HAS_USB
DECL_ENUMERATION_RANGE("pin", "PE0", PIN_NUMBER('E', 0), 8);
DECL_ENUMERATION_RANGE("pin", "PF0", PIN_NUMBER('F', 0), 8);
#endif
#if CONFIG_AVR_MEGA
DECL_ENUMERATION_RANGE("pin", "PG0", PIN_NUMBER('G', 0), 6);
DECL_ENUMERATION_RANGE("pin", "PH0", PIN_NUMBER('H', 0), 8);
DECL_ENUMERATION_RANGE("pin", "PJ0", PIN_NUMBER('J', 0), 8);
DECL_ENUMERATION_RANGE("pin", "PK0", PIN_NUMBER('K', 0), 8);
DECL_ENUMERATION_RANGE("pin", "PL0", PIN_NUMBER('L', 0), 8);
#endif

static volatile uint8_t *const ROM ports[] = {
#ifdef PINA
    &PINA,
#else
    0,
#endif
    &PINB, &PINC, &PIND,
#if CONFIG_AVR_MEGA || CONFIG_AVR_HAS_USB
    &PINE, &PINF,
#endif
#if CONFIG_AVR_MEGA
    &PING, &PINH, 0, &PINJ, &PINK, &PINL,
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
