/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of the SAM D5x and E5x: CLOCK_FREQ for the processor, 48 MHz for
 * peripherals (DS60001507, 14 and 28).
 *
 * Both PLLs multiply 32768 Hz of a crystal; or the first one multiplies 1 MHz,
 * made of the internal oscillator's 48 MHz or of a crystal of 25 MHz.
 */
#include "armcm/cpu.h"
#include "chip.h"

#define GEN_REF 2
#define MHZ (CONFIG_CLOCK_FREQ / 1000000)

/* Multiple in 32nds, as the register has it: one less, and the fraction */
#define RATIO(N32) (((N32) / 32 - 1) | ((N32) % 32) << 16)
/* MHZ / 0.032768 * 32, to the nearest: 2 ppm off at most */
#define RATIO_32K(HZ) \
    RATIO((uint32_t)((32ull * (HZ) + 16384) / 32768))

static void set_generator(uint32_t number, uint32_t source, uint32_t divider)
{
    GCLK_GENCTRL(number) = source | GCLK_GENCTRL_EN | GCLK_GENCTRL_IDC
        | GCLK_GENCTRL_DIV(divider);
    while (GCLK_SYNCBUSY)
        ;
}

/* Back to the internal oscillator, which runs after reset. */
void board_early_init(void)
{
    OSCCTRL_DFLLCTRLA = OSCCTRL_DFLLCTRLA_ENABLE;
    while (OSCCTRL_DFLLSYNC)
        ;
    while (!(OSCCTRL_STATUS & OSCCTRL_STATUS_DFLLRDY))
        ;
    set_generator(0, SOURCE_DFLL, 1);
    OSCCTRL_DPLLCTRLA(0) = OSCCTRL_DPLLCTRLA(1) = 0;
    while (OSCCTRL_DPLLSYNCBUSY(0) || OSCCTRL_DPLLSYNCBUSY(1))
        ;
    SAMD_REG32(MCLK_BASE + 0x20) = 0;
}

static void start_pll(uint32_t number, uint32_t ratio, uint32_t reference)
{
    OSCCTRL_DPLLRATIO(number) = ratio;
    while (OSCCTRL_DPLLSYNCBUSY(number))
        ;
    OSCCTRL_DPLLCTRLB(number) = reference | OSCCTRL_DPLLCTRLB_LBYPASS;
    OSCCTRL_DPLLCTRLA(number) = OSCCTRL_DPLLCTRLA_ENABLE;
    while (OSCCTRL_DPLLSYNCBUSY(number))
        ;
    while ((OSCCTRL_DPLLSTATUS(number) & OSCCTRL_DPLLSTATUS_READY)
           != OSCCTRL_DPLLSTATUS_READY)
        ;
}

#if CONFIG_CLOCK_REF_X32K
static void start_sources(void)
{
    OSC32KCTRL_XOSC32K = OSC32KCTRL_XOSC32K_CGM_STANDARD
        | OSC32KCTRL_XOSC32K_STARTUP(0) | OSC32KCTRL_XOSC32K_EN32K
        | OSC32KCTRL_XOSC32K_XTALEN | OSC32KCTRL_XOSC32K_ENABLE;
    while (!(OSC32KCTRL_STATUS & OSC32KCTRL_STATUS_XOSC32KRDY))
        ;
    start_pll(0, RATIO_32K(CONFIG_CLOCK_FREQ), OSCCTRL_DPLLCTRLB_REF_XOSC32K);
    start_pll(1, RATIO_32K(96000000), OSCCTRL_DPLLCTRLB_REF_XOSC32K);
    set_generator(GEN_PERIPHERALS, SOURCE_DPLL1, 2);
}
#elif CONFIG_CLOCK_REF_X25M
static void start_sources(void)
{
    OSCCTRL_XOSCCTRL1 = OSCCTRL_XOSCCTRL_STARTUP(7) | OSCCTRL_XOSCCTRL_CURRENT
        | OSCCTRL_XOSCCTRL_XTALEN | OSCCTRL_XOSCCTRL_ENABLE;
    while (!(OSCCTRL_STATUS & OSCCTRL_STATUS_XOSCRDY1))
        ;
    set_generator(GEN_REF, SOURCE_XOSC1, 25);
    chip_feed(CHANNEL_DPLL0, GEN_REF);
    chip_feed(CHANNEL_DPLL1, GEN_REF);
    start_pll(0, RATIO(32u * MHZ), OSCCTRL_DPLLCTRLB_REF_GCLK);
    start_pll(1, RATIO(32u * 96), OSCCTRL_DPLLCTRLB_REF_GCLK);
    set_generator(GEN_PERIPHERALS, SOURCE_DPLL1, 2);
}
#else
/* USB, where it is used, keeps the internal oscillator in step. */
static void start_sources(void)
{
    if (CONFIG_WANT_USB_DEVICE) {
        OSCCTRL_DFLLMUL = OSCCTRL_DFLLMUL_USB;
        while (OSCCTRL_DFLLSYNC)
            ;
        OSCCTRL_DFLLCTRLB = OSCCTRL_DFLLCTRLB_MODE | OSCCTRL_DFLLCTRLB_USBCRM
            | OSCCTRL_DFLLCTRLB_CCDIS;
        while (OSCCTRL_DFLLSYNC)
            ;
    }
    set_generator(GEN_PERIPHERALS, SOURCE_DFLL, 1);
    set_generator(GEN_REF, SOURCE_DFLL, 48);
    chip_feed(CHANNEL_DPLL0, GEN_REF);
    start_pll(0, RATIO(32u * MHZ), OSCCTRL_DPLLCTRLB_REF_GCLK);
}
#endif

/* The flash controller chooses its wait states itself. */
void board_clock_init(void)
{
    start_sources();
    set_generator(0, SOURCE_DPLL0, 1);
    CMCC_CTRL = 1;
}
