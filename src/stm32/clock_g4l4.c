/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of the STM32G4, 170 MHz, and L4, 80 MHz (RM0440, 7.2; RM0394, 6.2).
 */
#include "armcm/cpu.h"
#include "chip.h"

#if CONFIG_STM32_CLOCK_REF_INTERNAL
#define REF_FREQ 16000000
#define SOURCE RCC_PLLCFGR_SRC_HSI
#else
#define REF_FREQ CONFIG_CLOCK_REF_FREQ
#define SOURCE RCC_PLLCFGR_SRC_HSE
#endif

/* Behind the VCO: two */
#define PLL_INPUT (REF_FREQ % 4000000 ? 5000000 : 4000000)
#define PLL_M ((uint32_t)(REF_FREQ / PLL_INPUT))
#define PLL_N ((uint32_t)(2 * CONFIG_CLOCK_FREQ / PLL_INPUT))
_Static_assert(PLL_M <= 8 && REF_FREQ % PLL_INPUT == 0
               && PLL_N * PLL_INPUT == 2 * CONFIG_CLOCK_FREQ,
               "no such multiple");

/* Wait states: one for each 34 MHz with boost, 16 MHz of an L4 */
#define FLASH_LATENCY 4
/* The G4 goes above 80 MHz in two steps, 1 us apart */
#define STEP_LOOPS (CONFIG_CLOCK_FREQ / 2000000)

static void select_clock(uint32_t config, uint32_t status)
{
    RCC->CFGR = config;
    while ((RCC->CFGR & RCC_CFGR_SWS) != status)
        ;
}

/* Back to the internal oscillator, nothing on. */
void board_early_init(void)
{
    RCC->CR |= RCC_CR_HSION;
    while (!(RCC->CR & RCC_CR_HSIRDY))
        ;
    select_clock(RCC_CFGR_SW_HSI, RCC_CFGR_SWS_HSI);
    RCC->CR &= ~(RCC_CR_PLLON | RCC_CR_HSEON);
    while (RCC->CR & RCC_CR_PLLRDY)
        ;
    RCC->CIER = 0;
    RCC->APB1ENR1 = RCC->APB1ENR2 = RCC->APB2ENR = 0;
    RCC->APB1RSTR1 = RCC->APB2RSTR = RCC->AHB2RSTR = 0xffffffff;
    RCC->APB1RSTR1 = RCC->APB2RSTR = RCC->AHB2RSTR = 0;
}

#if CONFIG_MACH_STM32G4
static void raise_voltage(void)
{
    chip_enable(PWR_GATE);
    PWR_CR5 &= ~PWR_CR5_NO_BOOST;
}

static void pause_step(void)
{
    uint32_t i;

    for (i = 0; i < STEP_LOOPS; i++)
        __asm__ volatile("nop");
}
#endif

void board_clock_init(void)
{
    if (!CONFIG_STM32_CLOCK_REF_INTERNAL) {
        RCC->CR |= RCC_CR_HSEON;
        while (!(RCC->CR & RCC_CR_HSERDY))
            ;
    }
    RCC->PLLCFGR = SOURCE | RCC_PLLCFGR_M(PLL_M) | RCC_PLLCFGR_N(PLL_N)
        | RCC_PLLCFGR_R2;
    RCC->CR |= RCC_CR_PLLON;
    while (!(RCC->CR & RCC_CR_PLLRDY))
        ;
#if CONFIG_MACH_STM32G4
    raise_voltage();
#endif
    /* other bits are a debugger's */
    FLASH_ACR = (FLASH_ACR & ~FLASH_ACR_LATENCY) | FLASH_LATENCY
        | FLASH_ACR_PRFTEN | FLASH_ACR_ICEN | FLASH_ACR_DCEN;
    while ((FLASH_ACR & FLASH_ACR_LATENCY) != FLASH_LATENCY)
        ;
#if CONFIG_MACH_STM32G4
    select_clock(RCC_CFGR_SW_PLL | RCC_CFGR_HPRE_2, RCC_CFGR_SWS_PLL);
    pause_step();
#endif
    select_clock(RCC_CFGR_SW_PLL, RCC_CFGR_SWS_PLL);
}
