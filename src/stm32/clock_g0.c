/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of the STM32G0: 64 MHz (RM0444, 5.2). */
#include "armcm/cpu.h"
#include "chip.h"

#if CONFIG_STM32_CLOCK_REF_INTERNAL
#define REF_FREQ 16000000
#define SOURCE RCC_PLLCFGR_SRC_HSI
#else
#define REF_FREQ CONFIG_CLOCK_REF_FREQ
#define SOURCE RCC_PLLCFGR_SRC_HSE
#endif

/* The VCO runs at 256 or 320 MHz */
#if REF_FREQ % 4000000
#define PLL_INPUT 5000000
#define PLL_R 5u
#else
#define PLL_INPUT 4000000
#define PLL_R 4u
#endif
#define PLL_M ((uint32_t)(REF_FREQ / PLL_INPUT))
#define PLL_N (CONFIG_CLOCK_FREQ * PLL_R / PLL_INPUT)
_Static_assert(PLL_M <= 8 && REF_FREQ % PLL_INPUT == 0
               && PLL_INPUT / PLL_R * PLL_N == CONFIG_CLOCK_FREQ,
               "no such multiple");

/* Two wait states above 48 MHz */
#define FLASH_LATENCY 2

/* Back to the internal oscillator, nothing on. */
void board_early_init(void)
{
    RCC->CR |= RCC_CR_HSION;
    while (!(RCC->CR & RCC_CR_HSIRDY))
        ;
    RCC->CFGR = 0;
    while (RCC->CFGR & RCC_CFGR_SWS)
        ;
    RCC->CR &= ~(RCC_CR_PLLON | RCC_CR_HSEON);
    while (RCC->CR & RCC_CR_PLLRDY)
        ;
    RCC->CIER = 0;
    RCC->APBENR1 = RCC->APBENR2 = 0;
    RCC->APBRSTR1 = RCC->APBRSTR2 = RCC->IOPRSTR = 0xffffffff;
    RCC->APBRSTR1 = RCC->APBRSTR2 = RCC->IOPRSTR = 0;
}

/* Pins that may belong to USB type C lose the resistors it needs. */
static void free_pins(void)
{
    chip_enable(SYSCFG_GATE);
    SYSCFG_CFGR1 |= SYSCFG_CFGR1_UCPD_STROBES;
}

void board_clock_init(void)
{
    if (!CONFIG_STM32_CLOCK_REF_INTERNAL) {
        RCC->CR |= RCC_CR_HSEON;
        while (!(RCC->CR & RCC_CR_HSERDY))
            ;
    }
    RCC->PLLCFGR = SOURCE | RCC_PLLCFGR_M(PLL_M) | RCC_PLLCFGR_N(PLL_N)
        | RCC_PLLCFGR_R(PLL_R);
    RCC->CR |= RCC_CR_PLLON;
    while (!(RCC->CR & RCC_CR_PLLRDY))
        ;
    /* other bits are a debugger's */
    FLASH_ACR = (FLASH_ACR & ~FLASH_ACR_LATENCY) | FLASH_LATENCY
        | FLASH_ACR_PRFTEN | FLASH_ACR_ICEN;
    RCC->CFGR = RCC_CFGR_SW_PLL;
    while ((RCC->CFGR & RCC_CFGR_SWS) != RCC_CFGR_SWS_PLL)
        ;
    if (CONFIG_STM32_HAS_UCPD)
        free_pins();
}
