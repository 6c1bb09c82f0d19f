/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of the STM32H7: 400 MHz, or 520 MHz of an H723 (RM0433, 8.5; RM0468,
 * 8.5).  Buses run at a half of that, peripherals at a quarter. */
#include "armcm/cpu.h"
#include "chip.h"

#if CONFIG_STM32_CLOCK_REF_INTERNAL
#define REF_FREQ 64000000
#define SOURCE 0
#else
#define REF_FREQ CONFIG_CLOCK_REF_FREQ
#define SOURCE RCC_PLLCKSELR_HSE
#endif

#if CONFIG_MACH_STM32H723
#define PLL_P 1u
#define PLL_Q 13u                   /* 40 MHz for CAN */
#define VOLTAGE PWR_D3CR_VOS_SCALE0
#define FLASH_LATENCY 3u
#else
#define PLL_P 2u
#define PLL_Q 10u                   /* 80 MHz */
#define VOLTAGE PWR_D3CR_VOS_SCALE1
#define FLASH_LATENCY 2u
#endif
#define PLL_INPUT (REF_FREQ % 4000000 ? 5000000 : 4000000)
#define PLL_M ((uint32_t)(REF_FREQ / PLL_INPUT))
#define PLL_N ((uint32_t)(CONFIG_CLOCK_FREQ / PLL_INPUT * PLL_P))
_Static_assert(PLL_M * PLL_INPUT == REF_FREQ
               && PLL_N * PLL_INPUT == CONFIG_CLOCK_FREQ * PLL_P,
               "no such multiple");

/* Back to the internal oscillator, nothing on. */
void board_early_init(void)
{
    RCC->CR = (RCC->CR & ~RCC_CR_HSIDIV) | RCC_CR_HSION;
    while (!(RCC->CR & RCC_CR_HSIRDY))
        ;
    RCC->CFGR = 0;
    while (RCC->CFGR & RCC_CFGR_SWS)
        ;
    RCC->CR &= ~(RCC_CR_PLLON | RCC_CR_HSEON);
    while (RCC->CR & RCC_CR_PLLRDY)
        ;
    RCC->CIER = 0;
    RCC->APB1LENR = RCC->APB2ENR = 0;
    RCC->APB1LRSTR = RCC->APB2RSTR = RCC->AHB4RSTR = 0xffffffff;
    RCC->APB1LRSTR = RCC->APB2RSTR = RCC->AHB4RSTR = 0;
}

/* The supply must be told once before the voltage can change. */
static void raise_voltage(void)
{
    PWR->CR3 = (PWR->CR3 & ~PWR_CR3_BYPASS) | PWR_CR3_LDOEN;
    while (!(PWR->CSR1 & PWR_CSR1_ACTVOSRDY))
        ;
    PWR->D3CR = (PWR->D3CR & ~PWR_D3CR_VOS) | VOLTAGE;
    while (!(PWR->D3CR & PWR_D3CR_VOSRDY))
        ;
}

static void start_pll(void)
{
    if (!CONFIG_STM32_CLOCK_REF_INTERNAL) {
        RCC->CR |= RCC_CR_HSEON;
        while (!(RCC->CR & RCC_CR_HSERDY))
            ;
    }
    RCC->PLLCKSELR = SOURCE | RCC_PLLCKSELR_M(PLL_M);
    RCC->PLLCFGR = RCC_PLLCFGR_RANGE_4_8 | RCC_PLLCFGR_P_ON
        | RCC_PLLCFGR_Q_ON;
    RCC->PLL1DIVR = RCC_PLL1DIVR_N(PLL_N) | RCC_PLL1DIVR_P(PLL_P)
        | RCC_PLL1DIVR_Q(PLL_Q);
    RCC->CR |= RCC_CR_PLLON;
    while (!(RCC->CR & RCC_CR_PLLRDY))
        ;
}

void board_clock_init(void)
{
    raise_voltage();
    start_pll();
    FLASH_ACR = FLASH_LATENCY | FLASH_ACR_WRHIGHFREQ(FLASH_LATENCY);
    while ((FLASH_ACR & 15) != FLASH_LATENCY)
        ;
    RCC->D1CFGR = RCC_D1CFGR_HPRE_2 | RCC_D1CFGR_PPRE_2;
    RCC->D2CFGR = RCC_D2CFGR_PPRES_2;
    RCC->D3CFGR = RCC_D3CFGR_PPRE_2;
    RCC->CFGR = RCC_CFGR_SW_PLL;
    while ((RCC->CFGR & RCC_CFGR_SWS) != RCC_CFGR_SWS_PLL)
        ;
}
