/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins of the chip: number = 32 * bank + bit (SPRUH73, chapter 25).  Which of
 * its functions a pin has, and its pull, are Linux's to set; PRU0 has enabled
 * their clocks. */
#include "board/gpio.h"
#include "board/irq.h"
#include "core/sched.h"

DECL_ENUMERATION_RANGE("pin", "gpio0_0", 0, 32);
DECL_ENUMERATION_RANGE("pin", "gpio1_0", 32, 32);
DECL_ENUMERATION_RANGE("pin", "gpio2_0", 64, 32);
DECL_ENUMERATION_RANGE("pin", "gpio3_0", 96, 32);

static struct pru_bank banks[] = {
    { GPIO0_BASE + GPIO_CLEARDATAOUT, 0 },
    { GPIO1_BASE + GPIO_CLEARDATAOUT, 0 },
    { GPIO2_BASE + GPIO_CLEARDATAOUT, 0 },
    { GPIO3_BASE + GPIO_CLEARDATAOUT, 0 },
};
#define N_PINS (32 * sizeof(banks) / sizeof(banks[0]))

/* The register that says which pins are inputs, by another of its bank. */
static volatile uint32_t *find_inputs(uint32_t reg, uint32_t offset)
{
    return &REG32(reg - offset + GPIO_OE);
}

struct gpio_out gpio_setup_output(uint32_t pin, uint8_t level)
{
    struct gpio_out out = { &banks[pin / 32], 1u << (pin % 32) };

    if (pin >= N_PINS)
        shutdown("Not an output pin");
    gpio_drive(out, level);
    return out;
}

void gpio_drive(struct gpio_out out, uint8_t level)
{
    irq_flag_t flag = irq_save();

    gpio_write(out, level);
    *find_inputs(out.bank->clear, GPIO_CLEARDATAOUT) &= ~out.mask;
    irq_restore(flag);
}

void gpio_write(struct gpio_out out, uint8_t level)
{
    irq_flag_t flag = irq_save();

    out.bank->out = level ? out.bank->out | out.mask
        : out.bank->out & ~out.mask;
    pru_drive(out, level);
    irq_restore(flag);
}

void gpio_toggle_irq(struct gpio_out out)
{
    uint32_t levels = out.bank->out ^ out.mask;

    out.bank->out = levels;
    pru_drive(out, levels & out.mask);
}

void gpio_toggle(struct gpio_out out)
{
    gpio_toggle_irq(out);
}

struct gpio_in gpio_setup_input(uint32_t pin, int8_t pull)
{
    struct gpio_in in;

    if (pull)
        shutdown("PRU does not support push/pull pins");
    if (pin >= N_PINS)
        shutdown("Not a valid input pin");
    in.levels = banks[pin / 32].clear - GPIO_CLEARDATAOUT + GPIO_DATAIN;
    in.mask = 1u << (pin % 32);
    gpio_float(in, pull);
    return in;
}

void gpio_float(struct gpio_in in, int8_t pull)
{
    irq_flag_t flag = irq_save();

    (void)pull;
    *find_inputs(in.levels, GPIO_DATAIN) |= in.mask;
    irq_restore(flag);
}

uint8_t gpio_read(struct gpio_in in)
{
    return (REG32(in.levels) & in.mask) != 0;
}
