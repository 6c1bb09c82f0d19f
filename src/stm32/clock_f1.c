/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of the STM32F1: 72 MHz from a crystal of 8, 12 or 16 MHz, 64 MHz
 * without (RM0008, 7.2). */
#include "armcm/cpu.h"
#include "chip.h"

#if CONFIG_STM32_CLOCK_REF_INTERNAL
#define PLL_INPUT 4000000
#define PLL_BITS 0
#elif CONFIG_CLOCK_REF_FREQ == 16000000
#define PLL_INPUT 8000000
#define PLL_BITS (RCC_CFGR_PLLSRC_HSE | RCC_CFGR_PLLXTPRE)
#else
#define PLL_INPUT CONFIG_CLOCK_REF_FREQ
#define PLL_BITS RCC_CFGR_PLLSRC_HSE
#endif
#define PLL_FACTOR (CONFIG_CLOCK_FREQ / PLL_INPUT)
_Static_assert(PLL_FACTOR * PLL_INPUT == CONFIG_CLOCK_FREQ
               && PLL_FACTOR >= 2 && PLL_FACTOR <= 16, "no such multiple");

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
    RCC->CIR = 0;
    RCC->APB1ENR = RCC->APB2ENR = 0;
    RCC->APB1RSTR = RCC->APB2RSTR = 0xffffffff;
    RCC->APB1RSTR = RCC->APB2RSTR = 0;
}

void board_clock_init(void)
{
    uint32_t config = PLL_BITS | RCC_CFGR_PLLMUL(PLL_FACTOR)
        | RCC_CFGR_PPRE1_2 | RCC_CFGR_ADCPRE_6;

    if (!CONFIG_STM32_CLOCK_REF_INTERNAL) {
        RCC->CR |= RCC_CR_HSEON;
        while (!(RCC->CR & RCC_CR_HSERDY))
            ;
    }
    FLASH_ACR = FLASH_LATENCY | FLASH_ACR_PRFTBE;
    RCC->CFGR = config;
    RCC->CR |= RCC_CR_PLLON;
    while (!(RCC->CR & RCC_CR_PLLRDY))
        ;
    RCC->CFGR = config | RCC_CFGR_SW_PLL;
    while ((RCC->CFGR & RCC_CFGR_SWS) != RCC_CFGR_SWS_PLL)
        ;
}
