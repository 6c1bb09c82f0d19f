/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins: number = 32 * letter of the port + bit (11057, 31.5). */
#include "board/gpio.h"
#include "board/irq.h"
#include "chip.h"
#include "core/sched.h"

/* Identifiers of the ports, and which bits have a pin */
static const struct {
    uint32_t id, bits;
} ports[] = {
#if CONFIG_MACH_SAM3X8E
    { PIOA_ID, 0x3fffffff }, { PIOB_ID, 0xffffffff }, { PIOC_ID, 0x7fffffff },
    { PIOD_ID, 0x000007ff },
#elif CONFIG_MACH_SAM3X8C
    { PIOA_ID, 0x3fffffff }, { PIOB_ID, 0xffffffff }, { PIOC_ID, 0x00000001 },
#elif CONFIG_MACH_SAM4S
    { PIOA_ID, 0xffffffff }, { PIOB_ID, 0x00007fff }, { PIOC_ID, 0xffffffff },
#elif CONFIG_MACH_SAM4E
    { PIOA_ID, 0xffffffff }, { PIOB_ID, 0x00007fff }, { PIOC_ID, 0xffffffff },
    { PIOD_ID, 0xffffffff }, { PIOE_ID, 0x0000003f },
#elif CONFIG_MACH_SAME70
    { PIOA_ID, 0xffffffff }, { PIOB_ID, 0x000033ff }, { PIOC_ID, 0xffffffff },
    { PIOD_ID, 0xffffffff }, { PIOE_ID, 0x0000003f },
#endif
};
#define N_PORTS (sizeof(ports) / sizeof(ports[0]))

DECL_ENUMERATION_RANGE("pin", "PA0", 0, 32);
DECL_ENUMERATION_RANGE("pin", "PB0", 32, 32);
DECL_ENUMERATION_RANGE("pin", "PC0", 64, 32);
DECL_ENUMERATION_RANGE("pin", "PD0", 96, 32);
DECL_ENUMERATION_RANGE("pin", "PE0", 128, 32);

/* Of port B, on a SAM3X of port C: the system's until they are asked for */
#if CONFIG_MACH_SAM3X
#define SYSTEM_PORT 2
#define SYSTEM_BITS 0x0001
#define SYSTEM_SHIFT 12
#else
#define SYSTEM_PORT 1
#define SYSTEM_BITS 0x1cf0
#define SYSTEM_SHIFT 0
#endif

static void free_system_pin(uint32_t pin)
{
    uint32_t bit = 1u << (pin % 32);
    irq_flag_t flag = irq_save();

    if (pin / 32 == SYSTEM_PORT && bit & SYSTEM_BITS)
        CCFG_SYSIO |= bit << SYSTEM_SHIFT;
    irq_restore(flag);
}

/* The port's registers, with its clock on; NULL without such a pin. */
static struct pio_regs *open_port(uint32_t pin)
{
    uint32_t port = pin / 32;

    if (port >= N_PORTS || !(ports[port].bits & (1u << (pin % 32))))
        return NULL;
    chip_enable(ports[port].id);
    free_system_pin(pin);
    return (struct pio_regs *)PIO_BASE(port);
}

static void set_pull(struct pio_regs *regs, uint32_t bit, int8_t pull)
{
    regs->PUDR = bit;
#if !CONFIG_MACH_SAM3X
    regs->PPDDR = bit;
    if (pull < 0)
        regs->PPDER = bit;
#endif
    if (pull > 0)
        regs->PUER = bit;
}

struct gpio_out gpio_setup_output(uint32_t pin, uint8_t level)
{
    struct gpio_out out = { open_port(pin), 1u << (pin % 32) };

    if (!out.regs)
        shutdown("Not an output pin");
    gpio_drive(out, level);
    return out;
}

void gpio_drive(struct gpio_out out, uint8_t level)
{
    irq_flag_t flag = irq_save();

    gpio_write(out, level);
    out.regs->OWER = out.bit;
    out.regs->MDDR = out.bit;
    set_pull(out.regs, out.bit, 0);
    out.regs->OER = out.bit;
    out.regs->PER = out.bit;
    irq_restore(flag);
}

/* A SAM3X has no pull-down. */
struct gpio_in gpio_setup_input(uint32_t pin, int8_t pull)
{
    struct gpio_in in = { open_port(pin), 1u << (pin % 32) };

    if (!in.regs || (CONFIG_MACH_SAM3X && pull < 0))
        shutdown("Not a valid input pin");
    gpio_float(in, pull);
    return in;
}

void gpio_float(struct gpio_in in, int8_t pull)
{
    irq_flag_t flag = irq_save();

    in.regs->ODR = in.bit;
    in.regs->OWDR = in.bit;
    set_pull(in.regs, in.bit, pull);
    in.regs->PER = in.bit;
    irq_restore(flag);
}

static void set_bit(volatile uint32_t *reg, uint32_t bit, uint32_t on)
{
    *reg = on ? *reg | bit : *reg & ~bit;
}

void gpio_alternate(uint32_t pin, char peripheral, int8_t pull)
{
    struct pio_regs *regs = open_port(pin);
    uint32_t bit = 1u << (pin % 32), number = (uint32_t)(peripheral - 'A');
    irq_flag_t flag = irq_save();

    regs->MDDR = bit;
    set_pull(regs, bit, pull);
    set_bit(&regs->ABCDSR[0], bit, number & 1);
    if (!CONFIG_MACH_SAM3X)
        set_bit(&regs->ABCDSR[1], bit, number & 2);
    regs->PDR = bit;
    irq_restore(flag);
}

void gpio_open_drain(uint32_t pin, char peripheral)
{
    gpio_alternate(pin, peripheral, 1);
    open_port(pin)->MDER = 1u << (pin % 32);
}
