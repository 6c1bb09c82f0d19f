/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of the STM32F0: 48 MHz (RM0091, 6.2). */
#include "armcm/cpu.h"
#include "chip.h"

#if CONFIG_STM32_CLOCK_REF_INTERNAL
#define PLL_INPUT 4000000
#define PLL_BITS 0
#define PREDIV 1
#else
#define PLL_INPUT 4000000
#define PLL_BITS RCC_CFGR_PLLSRC_HSE
#define PREDIV (CONFIG_CLOCK_REF_FREQ / PLL_INPUT)
_Static_assert(PREDIV * PLL_INPUT == CONFIG_CLOCK_REF_FREQ, "no such divider");
#endif
#define PLL_FACTOR (CONFIG_CLOCK_FREQ / PLL_INPUT)

/* One wait state above 24 MHz */
#define FLASH_LATENCY 1

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
    RCC->CIR = 0;
    RCC->APB1ENR = RCC->APB2ENR = 0;
    RCC->APB1RSTR = RCC->APB2RSTR = RCC->AHBRSTR = 0xffffffff;
    RCC->APB1RSTR = RCC->APB2RSTR = RCC->AHBRSTR = 0;
}

/* This processor fetches its vectors from address 0: RAM is to be there. */
void board_map_vectors(void)
{
    chip_enable(SYSCFG_GATE);
    SYSCFG_CFGR1 |= SYSCFG_CFGR1_MEM_RAM
        | (CONFIG_STM32_PA11_PA12_REMAP ? SYSCFG_CFGR1_PA11_PA12 : 0);
}

void board_clock_init(void)
{
    uint32_t config = PLL_BITS | RCC_CFGR_PLLMUL(PLL_FACTOR);

    if (!CONFIG_STM32_CLOCK_REF_INTERNAL) {
        RCC->CR |= RCC_CR_HSEON;
        while (!(RCC->CR & RCC_CR_HSERDY))
            ;
    }
    FLASH_ACR = FLASH_LATENCY | FLASH_ACR_PRFTBE;
    RCC->CFGR2 = RCC_CFGR2_PREDIV(PREDIV);
    RCC->CFGR = config;
    RCC->CR |= RCC_CR_PLLON;
    while (!(RCC->CR & RCC_CR_PLLRDY))
        ;
    RCC->CFGR = config | RCC_CFGR_SW_PLL;
    while ((RCC->CFGR & RCC_CFGR_SWS) != RCC_CFGR_SWS_PLL)
        ;
}
