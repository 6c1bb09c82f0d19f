/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a pin does, on STM32F1 (RM0008, 9.1). */
#include "chip.h"
#include "gpio_mode.h"

/* Nibbles of CRL and CRH; outputs are of 10 MHz. */
#define NIBBLE_ANALOG 0x0u
#define NIBBLE_OUTPUT 0x1u
#define NIBBLE_FLOATING 0x4u
#define NIBBLE_PULLED 0x8u
#define NIBBLE_ALTERNATE 0x9u
#define NIBBLE_OPEN_DRAIN 0xdu

/* What AFIO_MAPR was told: the field that frees debug pins reads as
 * anything. */
static uint32_t remapped;

static uint32_t find_nibble(enum gpio_mode mode, int8_t pull)
{
    if (mode == GPIO_MODE_OUTPUT)
        return NIBBLE_OUTPUT;
    if (mode == GPIO_MODE_ANALOG)
        return NIBBLE_ANALOG;
    if (mode == GPIO_MODE_ALTERNATE && !pull)
        return NIBBLE_ALTERNATE;
    return pull ? NIBBLE_PULLED : NIBBLE_FLOATING;
}

/* An alternate function with a pull is an input. */
void gpio_set_mode(gpio_regs_t *regs, uint32_t bit, enum gpio_mode mode,
                   int8_t pull, uint8_t function)
{
    uint32_t index = (uint32_t)__builtin_ctz(bit);
    volatile uint32_t *control = index < 8 ? &regs->CRL : &regs->CRH;
    uint32_t shift = 4 * (index % 8), nibble = find_nibble(mode, pull);

    if (mode == GPIO_MODE_ALTERNATE && function & GPIO_OPEN_DRAIN)
        nibble = NIBBLE_OPEN_DRAIN;
    if (nibble == NIBBLE_PULLED)
        regs->BSRR = pull > 0 ? bit : bit << 16;
    *control = (*control & ~(0xfu << shift)) | nibble << shift;
}

void gpio_remap(uint32_t mask, uint32_t value)
{
    chip_enable(AFIO_GATE);
    remapped = (remapped & ~mask) | value;
    AFIO_MAPR = remapped;
}

void gpio_free_debug_pin(uint32_t pin)
{
    if (pin == GPIO('A', 13) || pin == GPIO('A', 14))
        gpio_remap(AFIO_MAPR_SWJ, AFIO_MAPR_SWJ_OFF);
    else if ((pin == GPIO('A', 15) || pin == GPIO('B', 3)
              || pin == GPIO('B', 4))
             && !(remapped & AFIO_MAPR_SWJ))
        gpio_remap(AFIO_MAPR_SWJ, AFIO_MAPR_SWJ_NO_JTAG);
}
