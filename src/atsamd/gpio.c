/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins: number = 32 * letter of the port + bit (data sheets, PORT). */
#include "board/gpio.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"

DECL_ENUMERATION_RANGE("pin", "PA0", 0, 32);
#if !CONFIG_MACH_SAMD21E18 && !CONFIG_MACH_SAMD21E15
#define PORTS_B 1
DECL_ENUMERATION_RANGE("pin", "PB0", 32, 32);
#else
#define PORTS_B 0
#endif
#if CONFIG_MACH_SAMD51N19 || CONFIG_MACH_SAMD51P20 || CONFIG_MACH_SAME51N19 \
    || CONFIG_MACH_SAME54P20
#define PORTS_C 1
DECL_ENUMERATION_RANGE("pin", "PC0", 64, 32);
#else
#define PORTS_C 0
#endif
#if CONFIG_MACH_SAMD51P20 || CONFIG_MACH_SAME54P20
#define PORTS_D 1
DECL_ENUMERATION_RANGE("pin", "PD0", 96, 32);
#else
#define PORTS_D 0
#endif
#define N_PINS (32 * (1 + PORTS_B + PORTS_C + PORTS_D))

static struct port_regs *port_of(uint32_t pin)
{
    return &((struct port_regs *)PORT_BASE)[pin / 32];
}

static struct port_regs *slow_port(struct port_regs *fast)
{
    return (struct port_regs *)((uintptr_t)fast - PORT_FAST_BASE + PORT_BASE);
}

/* Irqs off, for fields that two pins share.  Pulls go where the level is. */
static void set_mode(struct port_regs *regs, uint32_t index, int8_t pull,
                     uint8_t flags)
{
    if (pull > 0)
        regs->OUTSET = 1u << index;
    else if (pull < 0)
        regs->OUTCLR = 1u << index;
    regs->PINCFG[index] = (uint8_t)(PORT_PINCFG_INEN | flags
                                    | (pull ? PORT_PINCFG_PULLEN : 0));
}

void gpio_mux(uint32_t pin, uint32_t mux, int8_t pull)
{
    struct port_regs *regs = port_of(pin);
    uint32_t index = pin % 32, shift = 4 * (index & 1);
    irq_flag_t flag = irq_save();

    regs->PMUX[index / 2] = (uint8_t)((regs->PMUX[index / 2] & ~(0xf << shift))
                                      | mux << shift);
    regs->DIRCLR = 1u << index;
    set_mode(regs, index, pull, PORT_PINCFG_PMUXEN);
    if (mux == MUX_B)
        regs->PINCFG[index] = PORT_PINCFG_PMUXEN;
    irq_restore(flag);
}

struct gpio_out gpio_setup_output(uint32_t pin, uint8_t level)
{
    struct gpio_out out = { gpio_fast(port_of(pin)), 1u << pin % 32 };

    if (pin >= N_PINS)
        shutdown("Not an output pin");
    gpio_drive(out, level);
    return out;
}

void gpio_drive(struct gpio_out out, uint8_t level)
{
    irq_flag_t flag = irq_save();

    gpio_write(out, level);
    out.regs->DIRSET = out.bit;
    set_mode(slow_port(out.regs), (uint32_t)__builtin_ctz(out.bit), 0, 0);
    irq_restore(flag);
}

/* The input is read by the bus, where it is sampled when asked for. */
struct gpio_in gpio_setup_input(uint32_t pin, int8_t pull)
{
    struct gpio_in in = { port_of(pin), 1u << pin % 32 };

    if (pin >= N_PINS)
        shutdown("Not a valid input pin");
    gpio_float(in, pull);
    return in;
}

void gpio_float(struct gpio_in in, int8_t pull)
{
    irq_flag_t flag = irq_save();

    in.regs->DIRCLR = in.bit;
    set_mode(in.regs, (uint32_t)__builtin_ctz(in.bit), pull, 0);
    irq_restore(flag);
}
