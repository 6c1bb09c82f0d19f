/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks: a crystal of 12 MHz, the processor at SYS_MHZ, 48 MHz for USB and the
 * converter (data sheet, 2.15 to 2.18). */
#include "armcm/cpu.h"
#include "chip.h"

#define CLOCK(N) (&((struct clock_regs *)CLOCKS_BASE)[N])
#define XOSC ((struct xosc_regs *)XOSC_BASE)
#define PLL_SYS ((struct pll_regs *)PLL_SYS_BASE)
#define PLL_USB ((struct pll_regs *)PLL_USB_BASE)

/* Oscillation is good after 1 ms, counted in 256 cycles */
#define STARTUP_COUNT ((XOSC_FREQ / 1000 + 255) / 256)
/* 1500 MHz / 6 / 2 = 125 MHz, / 5 / 2 = 150; 1440 MHz / 6 / 5 = 48 MHz */
#define SYS_MULTIPLE 125
#define SYS_DIVIDER (CONFIG_MACH_RP2350 ? 5 : 6)
#define SYS_DIVIDERS PLL_PRIM(SYS_DIVIDER, 2)
_Static_assert(SYS_MULTIPLE * XOSC_FREQ / SYS_DIVIDER / 2 == SYS_FREQ,
               "no such multiple");
#define USB_MULTIPLE 120
#define USB_DIVIDERS PLL_PRIM(6, 5)

/* Off the PLLs, everything in reset but what reads the flash chip. */
void board_early_init(void)
{
    RP_CLR(WATCHDOG->CTRL) = WATCHDOG_CTRL_ENABLE;
    CLOCK(CLOCK_SYS)->CTRL = CLK_SYS_SRC_REF;
    while (CLOCK(CLOCK_SYS)->SELECTED != 1u << CLK_SYS_SRC_REF)
        ;
    CLOCK(CLOCK_REF)->CTRL = 0;
    while (CLOCK(CLOCK_REF)->SELECTED != 1)
        ;
    RESETS->RESET = RESETS_ALL & ~(1u << RESET_IO_QSPI | 1u << RESET_PADS_QSPI);
}

static void start_pll(struct pll_regs *pll, uint32_t reset_bit,
                      uint32_t multiple, uint32_t dividers)
{
    chip_enable(reset_bit);
    pll->CS = 1;
    pll->FBDIV_INT = multiple;
    RP_CLR(pll->PWR) = PLL_PWR_PD | PLL_PWR_VCOPD;
    while (!(pll->CS & PLL_CS_LOCK))
        ;
    pll->PRIM = dividers;
    RP_CLR(pll->PWR) = PLL_PWR_POSTDIVPD;
}

static void start_crystal(void)
{
    XOSC->STARTUP = STARTUP_COUNT;
    XOSC->CTRL = XOSC_CTRL_ENABLE_1_15MHZ;
    while (!(XOSC->STATUS & XOSC_STATUS_STABLE))
        ;
    CLOCK(CLOCK_REF)->CTRL = CLK_REF_SRC_XOSC;
    while (CLOCK(CLOCK_REF)->SELECTED != 1u << CLK_REF_SRC_XOSC)
        ;
}

void board_clock_init(void)
{
    start_crystal();
    start_pll(PLL_SYS, RESET_PLL_SYS, SYS_MULTIPLE, SYS_DIVIDERS);
    start_pll(PLL_USB, RESET_PLL_USB, USB_MULTIPLE, USB_DIVIDERS);
    CLOCK(CLOCK_SYS)->CTRL = CLK_SYS_SRC_REF | CLK_SYS_AUX_PLL_SYS;
    CLOCK(CLOCK_SYS)->CTRL = CLK_SYS_SRC_AUX | CLK_SYS_AUX_PLL_SYS;
    while (CLOCK(CLOCK_SYS)->SELECTED != 1u << CLK_SYS_SRC_AUX)
        ;
    CLOCK(CLOCK_PERI)->CTRL = CLK_ENABLE | CLK_PERI_AUX_SYS;
    CLOCK(CLOCK_USB)->CTRL = CLK_ENABLE | CLK_USB_AUX_PLL_USB;
    CLOCK(CLOCK_ADC)->CTRL = CLK_ENABLE | CLK_ADC_AUX_PLL_USB;
    chip_enable(RESET_IO_BANK0);
    chip_enable(RESET_PADS_BANK0);
}
