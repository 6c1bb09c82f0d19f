/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of the SAM D21: 48 MHz for everything, from a crystal of 32768 Hz by
 * the PLL, or from the internal oscillator, which USB keeps in step
 * (DS40001882, 15 and 17). */
#include "armcm/cpu.h"
#include "chip.h"

/* 32768 Hz * (2929 + 11 / 16) = 96 MHz */
#define DPLL_RATIO (2928u | 11u << 16)
/* One wait state above 24 MHz */
#define WAIT_STATES 1
#define MIDDLE 0x1ffu

static void wait_sync(void)
{
    while (GCLK_STATUS & GCLK_BUSY)
        ;
}

static void set_generator(uint32_t number, uint32_t source, uint32_t divider,
                          uint32_t flags)
{
    GCLK_GENDIV = number | GCLK_GENDIV_DIV(divider);
    wait_sync();
    GCLK_GENCTRL = number | GCLK_GENCTRL_SRC(source) | GCLK_GENCTRL_EN | flags;
    wait_sync();
}

/* Back to the internal 8 MHz oscillator; clocks of most peripherals off. */
void board_early_init(void)
{
    SYSCTRL_OSC8M &= ~SYSCTRL_OSC8M_PRESC;
    set_generator(0, SOURCE_OSC8M, 1, 0);
    SYSCTRL_DFLLCTRL = 0;
    SYSCTRL_DPLLCTRLA = 0;
    SAMD_REG32(PM_BASE + 0x20) = 0;
}

/* An open loop near 48 MHz by the factory's numbers; the erratum wants it ready
 * before it is set up. */
static void start_dfll(void)
{
    SYSCTRL_DFLLCTRL = SYSCTRL_DFLLCTRL_ENABLE;
    while (!(SYSCTRL_PCLKSR & SYSCTRL_PCLKSR_DFLLRDY))
        ;
    SYSCTRL_DFLLVAL = SYSCTRL_DFLLVAL_COARSE(NVM_DFLL_COARSE) | MIDDLE;
    while (!(SYSCTRL_PCLKSR & SYSCTRL_PCLKSR_DFLLRDY))
        ;
    if (!CONFIG_USBSERIAL)
        return;
    SYSCTRL_DFLLMUL = SYSCTRL_DFLLMUL_USB;
    while (!(SYSCTRL_PCLKSR & SYSCTRL_PCLKSR_DFLLRDY))
        ;
    SYSCTRL_DFLLCTRL = SYSCTRL_DFLLCTRL_ENABLE | SYSCTRL_DFLLCTRL_MODE
        | SYSCTRL_DFLLCTRL_USBCRM | SYSCTRL_DFLLCTRL_CCDIS;
    while (!(SYSCTRL_PCLKSR & SYSCTRL_PCLKSR_DFLLRDY))
        ;
}

static void start_pll(void)
{
    SYSCTRL_XOSC32K = SYSCTRL_XOSC32K_STARTUP(6) | SYSCTRL_XOSC32K_XTALEN
        | SYSCTRL_XOSC32K_EN32K;
    SYSCTRL_XOSC32K |= SYSCTRL_XOSC32K_ENABLE;
    while (!(SYSCTRL_PCLKSR & SYSCTRL_PCLKSR_XOSC32KRDY))
        ;
    SYSCTRL_DPLLRATIO = DPLL_RATIO;
    SYSCTRL_DPLLCTRLB = SYSCTRL_DPLLCTRLB_REF_XOSC32K
        | SYSCTRL_DPLLCTRLB_LBYPASS;
    SYSCTRL_DPLLCTRLA = SYSCTRL_DPLLCTRLA_ENABLE;
    while ((SYSCTRL_DPLLSTATUS & SYSCTRL_DPLLSTATUS_READY)
           != SYSCTRL_DPLLSTATUS_READY)
        ;
}

void board_clock_init(void)
{
    NVMCTRL_CTRLB = NVMCTRL_CTRLB_MANW | NVMCTRL_CTRLB_RWS(WAIT_STATES);
    if (CONFIG_CLOCK_REF_X32K) {
        start_pll();
        set_generator(0, SOURCE_DPLL, 2, GCLK_GENCTRL_IDC);
    } else {
        start_dfll();
        set_generator(0, SOURCE_DFLL48M, 1, GCLK_GENCTRL_IDC);
    }
    /* 1024 Hz for the watchdog */
    set_generator(2, SOURCE_OSCULP32K, 32, 0);
    chip_feed(CHANNEL_WDT, 2);
}
