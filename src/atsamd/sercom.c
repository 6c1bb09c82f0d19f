/* SPDX-License-Identifier: GPL-3.0-or-later
 * SERCOM units: clocks, pins (data sheets, SERCOM). */
#include <stddef.h>

#include "chip.h"
#include "core/sched.h"
#include "sercom.h"
#include "sercom_pins.h"

/* The last is what hosts look for, the others what options are called */
DECL_ENUMERATION_RANGE("spi_bus", "sercom0", 0, 8);
DECL_ENUMERATION_RANGE("i2c_bus", "sercom0", 0, 8);
DECL_ENUMERATION_RANGE("bus", "sercom0", 0, 8);
DECL_ENUMERATION("sercom_pin_type", "tx", 0);
DECL_ENUMERATION("sercom_pin_type", "rx", 1);
DECL_ENUMERATION("sercom_pin_type", "clk", 2);

struct unit {
    struct sercom_regs *regs;
    uint16_t gate;
    uint8_t channel, irq;
};
#define UNIT_ENTRY(BASE, GATE, CHANNEL, IRQ) \
    { (struct sercom_regs *)(BASE), GATE, CHANNEL, IRQ },
static const struct unit units[SERCOM_COUNT] = { SERCOMS(UNIT_ENTRY) };

struct pad {
    uint8_t pin, unit_pad, mux; /* unit_pad: unit << 4 | pad */
};
#define PAD_ENTRY(LETTER, BIT, UNIT, PAD, MUX) \
    { GPIO(LETTER, BIT), (UNIT) << 4 | (PAD), MUX },
static const struct pad pads[] = { SERCOM_PINS(PAD_ENTRY) };

/* Pins by role, as the host has set them; 0: none (PA0 is a crystal's), else
 * the number plus one */
static uint8_t roles[SERCOM_COUNT][SERCOM_ROLES];

struct sercom_regs *sercom_open(uint32_t unit)
{
    struct sercom_regs *regs;

    if (unit >= SERCOM_COUNT)
        return NULL;
    regs = units[unit].regs;
    chip_enable(units[unit].gate);
    chip_feed(units[unit].channel, GEN_PERIPHERALS);
    regs->CTRLA = SERCOM_CTRLA_SWRST;
    while (regs->CTRLA & SERCOM_CTRLA_SWRST || regs->SYNCBUSY)
        ;
    return regs;
}

uint32_t sercom_irq(uint32_t unit)
{
    return units[unit].irq;
}

static const struct pad *find_pad(uint32_t unit, uint32_t pin)
{
    const struct pad *p = pads;

    for (; p < pads + sizeof(pads) / sizeof(pads[0]); p++)
        if (p->pin == pin && p->unit_pad >> 4 == unit)
            return p;
    return NULL;
}

uint8_t sercom_connect(uint32_t unit, uint32_t pin, int8_t pull)
{
    const struct pad *p = find_pad(unit, pin);

    if (!p)
        return SERCOM_NO_PAD;
    gpio_mux(pin, p->mux, pull);
    return p->unit_pad & 15;
}

uint8_t sercom_connect_role(uint32_t unit, enum sercom_role role, int8_t pull)
{
    uint8_t pin = roles[unit][role];

    return pin ? sercom_connect(unit, pin - 1u, pull) : SERCOM_NO_PAD;
}

void command_set_sercom_pin(const struct args_set_sercom_pin *args)
{
    if (args->bus >= SERCOM_COUNT)
        shutdown("Invalid SERCOM bus");
    if (args->sercom_pin_type >= SERCOM_ROLES
        || !find_pad(args->bus, args->pin))
        shutdown("Invalid SERCOM configuration");
    roles[args->bus][args->sercom_pin_type] = (uint8_t)(args->pin + 1);
}
DECL_COMMAND(command_set_sercom_pin,
             "set_sercom_pin bus=%u sercom_pin_type=%u pin=%u");
