/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins (data sheet, 2.19 and 2.3.1.2). */
#include "board/gpio.h"
#include "chip.h"
#include "core/sched.h"

#if CONFIG_MACH_RP2350
DECL_ENUMERATION_RANGE("pin", "gpio0", 0, 48);
#define PIN_AT(N) { (struct sio_regs *)(SIO_BASE + 4 * ((N) / 32)), \
    1u << (N) % 32 }
#define NUMBER_OF(PIN) ((uint32_t)__builtin_ctz((PIN).bit) \
                        + ((PIN).regs == SIO ? 0 : 32))
#else
DECL_ENUMERATION_RANGE("pin", "gpio0", 0, 30);
#define PIN_AT(N) { 1u << (N) % 32 }
#define NUMBER_OF(PIN) ((uint32_t)__builtin_ctz((PIN).bit))
#endif

#define IO ((struct io_regs *)IO_BANK0_BASE)
#define PADS ((struct pads_regs *)PADS_BANK0_BASE)

static uint32_t pad_bits(int8_t pull)
{
    return PAD_DRIVE_4MA | PAD_SCHMITT | PAD_INPUT
        | (pull > 0 ? PAD_PULL_UP : pull < 0 ? PAD_PULL_DOWN : 0);
}

/* First the pad, then who drives it, then its isolation (RP2350). */
void gpio_function(uint32_t pin, uint32_t function, int8_t pull)
{
    PADS->GPIO[pin] = pad_bits(pull) | PAD_ISOLATED;
    IO->GPIO[pin].CTRL = function;
    PADS->GPIO[pin] = pad_bits(pull);
}

void gpio_analog(uint32_t pin)
{
    IO->GPIO[pin].CTRL = IO_NONE;
    PADS->GPIO[pin] = PAD_OUTPUT_OFF;
}

struct gpio_out gpio_setup_output(uint32_t pin, uint8_t level)
{
    struct gpio_out out = PIN_AT(pin);

    if (pin >= N_PINS)
        shutdown("Not an output pin");
    gpio_drive(out, level);
    return out;
}

static void set_digital(uint32_t pin, int8_t pull)
{
    if (IO->GPIO[pin].CTRL != IO_SIO)
        gpio_function(pin, IO_SIO, pull);
    else
        PADS->GPIO[pin] = pad_bits(pull);
}

void gpio_drive(struct gpio_out out, uint8_t level)
{
    gpio_write(out, level);
    PIN_REGS(out)->OE_SET = out.bit;
    set_digital(NUMBER_OF(out), 0);
}

struct gpio_in gpio_setup_input(uint32_t pin, int8_t pull)
{
    struct gpio_in in = PIN_AT(pin);

    if (pin >= N_PINS)
        shutdown("Not a valid input pin");
    gpio_float(in, pull);
    return in;
}

void gpio_float(struct gpio_in in, int8_t pull)
{
    PIN_REGS(in)->OE_CLR = in.bit;
    set_digital(NUMBER_OF(in), pull);
}
