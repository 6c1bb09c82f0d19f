/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of peripherals; the boot loader. */
#include "board/irq.h"
#include "board/reset.h"
#include "chip.h"
#include "core/decl.h"

#if CONFIG_CLOCK_REF_X32K
DECL_CONSTANT_STR("RESERVE_PINS_crystal", "PA0,PA1");
#elif CONFIG_MACH_SAMC21
DECL_CONSTANT_STR("RESERVE_PINS_crystal", "PA14,PA15");
#elif CONFIG_CLOCK_REF_X25M
DECL_CONSTANT_STR("RESERVE_PINS_crystal", "PB22,PB23");
#endif

void chip_enable(uint32_t gate)
{
    volatile uint32_t *reg = (volatile uint32_t *)(GATES_BASE + (gate >> 5));
    irq_flag_t flag = irq_save();

    *reg |= 1u << (gate & 31);
    irq_restore(flag);
}

/* A channel changes its generator while it is off only; one that is right is
 * left alone, as others may use it. */
#if CONFIG_MACH_SAMD21
void chip_feed(uint32_t channel, uint32_t generator)
{
    uint16_t wanted = (uint16_t)(channel | GCLK_CLKCTRL_GEN(generator)
                                 | GCLK_CLKCTRL_EN);

    /* chooses what is read */
    GCLK_CLKCTRL_ID = (uint8_t)channel;
    if (GCLK_CLKCTRL == wanted)
        return;
    GCLK_CLKCTRL = (uint16_t)channel;
    while (GCLK_STATUS & GCLK_BUSY || GCLK_CLKCTRL & GCLK_CLKCTRL_EN)
        ;
    GCLK_CLKCTRL = wanted;
    while (GCLK_STATUS & GCLK_BUSY)
        ;
}
#else
void chip_feed(uint32_t channel, uint32_t generator)
{
    uint32_t wanted = generator | GCLK_PCHCTRL_CHEN;

    if (GCLK_PCHCTRL(channel) == wanted)
        return;
    GCLK_PCHCTRL(channel) = 0;
    while (GCLK_PCHCTRL(channel) & GCLK_PCHCTRL_CHEN)
        ;
    GCLK_PCHCTRL(channel) = wanted;
    while (!(GCLK_PCHCTRL(channel) & GCLK_PCHCTRL_CHEN))
        ;
}
#endif

/* Boot loaders look at the last word of memory: what is there after two resets
 * in a row keeps them from starting the program. */
#if CONFIG_MACH_SAMX5
#define BOOT_KEY 0xf01669efu
#else
#define BOOT_KEY 0x07738135u
#endif

void reset_to_bootloader(void)
{
    irq_disable();
    *(volatile uint32_t *)(CONFIG_RAM_START + CONFIG_RAM_SIZE - 4) = BOOT_KEY;
    reset_mcu();
}
