/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of the SAM C21: 48 MHz for everything, by the PLL from a crystal of 12
 * or 25 MHz (DS60001479, 16 and 20). */
#include "armcm/cpu.h"
#include "chip.h"

#if CONFIG_CLOCK_REF_X25M
#define REF_HZ 25000000u
#define GAIN 4
#else
#define REF_HZ 12000000u
#define GAIN 3
#endif
/* The PLL gets 500 kHz = crystal / (2 * (1 + divider)) and makes 96 MHz */
#define PLL_INPUT 500000u
#define PLL_DIVIDER (REF_HZ / PLL_INPUT / 2 - 1)
_Static_assert(REF_HZ == 2 * (PLL_DIVIDER + 1) * PLL_INPUT, "no such divider");
#define PLL_RATIO (96000000u / PLL_INPUT - 1)
/* Two wait states above 38 MHz */
#define WAIT_STATES 2

static void set_generator(uint32_t source, uint32_t divider)
{
    GCLK_GENCTRL(0) = source | GCLK_GENCTRL_EN | GCLK_GENCTRL_IDC
        | GCLK_GENCTRL_DIV(divider);
    while (GCLK_SYNCBUSY)
        ;
}

/* Back to the internal oscillator; clocks of most peripherals off. */
void board_early_init(void)
{
    set_generator(SOURCE_OSC48M, 1);
    OSCCTRL_DPLLCTRLA = 0;
    while (OSCCTRL_DPLLSYNCBUSY)
        ;
    SAMD_REG32(MCLK_BASE + 0x1c) = 0;
}

void board_clock_init(void)
{
    NVMCTRL_CTRLB = NVMCTRL_CTRLB_MANW | NVMCTRL_CTRLB_RWS(WAIT_STATES);
    OSCCTRL_XOSCCTRL = OSCCTRL_XOSCCTRL_STARTUP(7) | OSCCTRL_XOSCCTRL_GAIN(GAIN)
        | OSCCTRL_XOSCCTRL_XTALEN | OSCCTRL_XOSCCTRL_ENABLE;
    while (!(OSCCTRL_STATUS & OSCCTRL_STATUS_XOSCRDY))
        ;
    OSCCTRL_DPLLRATIO = PLL_RATIO;
    OSCCTRL_DPLLCTRLB = OSCCTRL_DPLLCTRLB_REF_XOSC
        | OSCCTRL_DPLLCTRLB_DIV(PLL_DIVIDER);
    while (OSCCTRL_DPLLSYNCBUSY)
        ;
    OSCCTRL_DPLLCTRLA = OSCCTRL_DPLLCTRLA_ENABLE;
    while ((OSCCTRL_DPLLSTATUS & OSCCTRL_DPLLSTATUS_READY)
           != OSCCTRL_DPLLSTATUS_READY)
        ;
    set_generator(SOURCE_DPLL, 2);
}
