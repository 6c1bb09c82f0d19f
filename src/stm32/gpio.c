/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins: number = 16 * letter of the port + bit. */
#include "board/gpio.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"
#include "gpio_mode.h"
#include "gpio_ports.h"

static gpio_regs_t *port_regs(uint32_t pin)
{
    return (gpio_regs_t *)(GPIO_BASE + 0x400 * (pin / 16));
}

/* The port's registers, with its clock on; NULL without such a pin. */
static gpio_regs_t *open_port(uint32_t pin)
{
    uint32_t port = pin / 16;

    if (port > 15 || !(GPIO_PORTS & (1u << port)))
        return NULL;
    chip_enable(GPIO_GATE(port));
    gpio_free_debug_pin(pin);
    return port_regs(pin);
}

struct gpio_out gpio_setup_output(uint32_t pin, uint8_t level)
{
    struct gpio_out out = { open_port(pin), 1u << (pin % 16) };

    if (!out.regs)
        shutdown("Not an output pin");
    gpio_drive(out, level);
    return out;
}

void gpio_drive(struct gpio_out out, uint8_t level)
{
    irq_flag_t flag = irq_save();

    gpio_write(out, level);
    gpio_set_mode(out.regs, out.bit, GPIO_MODE_OUTPUT, 0, 0);
    irq_restore(flag);
}

struct gpio_in gpio_setup_input(uint32_t pin, int8_t pull)
{
    struct gpio_in in = { open_port(pin), 1u << (pin % 16) };

    if (!in.regs)
        shutdown("Not a valid input pin");
    gpio_float(in, pull);
    return in;
}

void gpio_float(struct gpio_in in, int8_t pull)
{
    irq_flag_t flag = irq_save();

    gpio_set_mode(in.regs, in.bit, GPIO_MODE_INPUT, pull, 0);
    irq_restore(flag);
}

void gpio_alternate(uint32_t pin, uint8_t function, int8_t pull)
{
    gpio_regs_t *regs = open_port(pin);
    irq_flag_t flag = irq_save();

    gpio_set_mode(regs, 1u << (pin % 16), GPIO_MODE_ALTERNATE, pull, function);
    irq_restore(flag);
}

void gpio_analog(uint32_t pin)
{
    gpio_regs_t *regs = open_port(pin);
    irq_flag_t flag = irq_save();

    gpio_set_mode(regs, 1u << (pin % 16), GPIO_MODE_ANALOG, 0, 0);
    irq_restore(flag);
}
