/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of SAM3X, SAM4 and SAM E70, from a crystal of 12 MHz (11057,
 * 28.12). */
#include "armcm/cpu.h"
#include "board/irq.h"
#include "chip.h"
#include "core/decl.h"

/* A SAM3X has pins for nothing else. */
#if !CONFIG_MACH_SAM3X
DECL_CONSTANT_STR("RESERVE_PINS_crystal", "PB8,PB9");
#endif

#define CRYSTAL_FREQ 12000000u

/* Factor of the PLL, divider behind it, wait states of flash at 3.3 V */
#if CONFIG_MACH_SAM3X
#define PLL_FACTOR 14u
#define DIVIDER 2u
#define WAIT_STATES 4u
#elif CONFIG_MACH_SAME70
#define PLL_FACTOR 25u
#define DIVIDER 1u
#define WAIT_STATES 6u
#else
#define PLL_FACTOR 20u
#define DIVIDER 2u
#define WAIT_STATES 5u
#endif
_Static_assert(CRYSTAL_FREQ * PLL_FACTOR / DIVIDER == CONFIG_CLOCK_FREQ,
               "no such multiple");

/* Until crystal and PLL are steady, in units of 8 and 1 of the slow clock */
#define CRYSTAL_COUNT 255
#define PLL_COUNT 63u

static void wait_for(uint32_t bit)
{
    while (!(PMC->SR & bit))
        ;
}

/* One field at a time, each until it is so. */
static void change_clock(uint32_t field, uint32_t value)
{
    PMC->MCKR = (PMC->MCKR & ~field) | value;
    wait_for(PMC_SR_MCKRDY);
}

/* Back to the internal oscillator; all peripherals off. */
void board_early_init(void)
{
    change_clock(PMC_MCKR_CSS, PMC_MCKR_CSS_MAIN);
    change_clock(PMC_MCKR_PRES, 0);
    PMC->MOR = (PMC->MOR & PMC_MOR_MOSCRCF) | PMC_MOR_KEY | PMC_MOR_MOSCRCEN;
    wait_for(PMC_SR_MOSCSELS);
    PMC->PLLAR = PMC_PLLAR_ONE;
    PMC->PCDR0 = PMC->PCDR1 = 0xffffffff;
}

static void start_crystal(void)
{
    uint32_t mor = (PMC->MOR & PMC_MOR_MOSCRCF) | PMC_MOR_KEY
        | PMC_MOR_MOSCRCEN | PMC_MOR_MOSCXTEN
        | PMC_MOR_MOSCXTST(CRYSTAL_COUNT);

    PMC->MOR = mor;
    wait_for(PMC_SR_MOSCXTS);
    PMC->MOR = mor | PMC_MOR_MOSCSEL;
    wait_for(PMC_SR_MOSCSELS);
}

void board_clock_init(void)
{
    ((struct efc_regs *)EFC0_BASE)->FMR = EFC_FMR_FWS(WAIT_STATES);
#ifdef EFC1_BASE
    ((struct efc_regs *)EFC1_BASE)->FMR = EFC_FMR_FWS(WAIT_STATES);
#endif
    start_crystal();
    PMC->PLLAR = PMC_PLLAR_ONE | PMC_PLLAR_MUL(PLL_FACTOR)
        | PMC_PLLAR_COUNT(PLL_COUNT) | PMC_PLLAR_DIV1;
    wait_for(PMC_SR_LOCKA);
    if (CONFIG_MACH_SAME70)
        change_clock(PMC_MCKR_MDIV, PMC_MCKR_MDIV_2);
    else
        change_clock(PMC_MCKR_PRES, PMC_MCKR_PRES_2);
    change_clock(PMC_MCKR_CSS, PMC_MCKR_CSS_PLLA);
}

void chip_enable(uint32_t id)
{
    if (id < 32)
        PMC->PCER0 = 1u << id;
    else
        PMC->PCER1 = 1u << (id - 32);
}
