/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of the STM32F2, F4 and F7 (RM0090, 7.2): what a chip does differently
 * is in the table at the top. */
#include "armcm/cpu.h"
#include "chip.h"

/* Wait states of flash at 3.3 V; divider behind the VCO, of 48 MHz; bits of
 * voltage scaling; frequencies of the buses */
#if CONFIG_MACH_STM32F207
#define CHIP_LIMITS { .latency = 3, .p = 2, .q = 5, .r = 0, .apb1 = 4, \
                      .apb2 = 2, .vos = 0 }
#define VCO_FREQ 240000000
#elif CONFIG_MACH_STM32F401
#define CHIP_LIMITS { .latency = 2, .p = 4, .q = 7, .r = 0, .apb1 = 2, \
                      .apb2 = 1, .vos = PWR_CR_VOS_SCALE2 }
#define VCO_FREQ 336000000
#elif CONFIG_MACH_STM32F4x5
#define CHIP_LIMITS { .latency = 5, .p = 2, .q = 7, .r = 0, .apb1 = 4, \
                      .apb2 = 2, .vos = PWR_CR_VOS_F40X }
#define VCO_FREQ 336000000
#elif CONFIG_MACH_STM32F446
#define CHIP_LIMITS { .latency = 5, .p = 2, .q = 8, .r = 2, .apb1 = 4, \
                      .apb2 = 2, .vos = PWR_CR_VOS_SCALE1 }
#define VCO_FREQ 360000000
#elif CONFIG_MACH_STM32F765
#define CHIP_LIMITS { .latency = 7, .p = 2, .q = 9, .r = 2, .apb1 = 4, \
                      .apb2 = 2, .vos = PWR_CR_VOS_SCALE1 }
#define VCO_FREQ 432000000
#endif

struct limits {
    uint8_t latency, p, q, r, apb1, apb2;
    uint32_t vos;
};
static const struct limits limits = CHIP_LIMITS;

#if CONFIG_STM32_CLOCK_REF_INTERNAL
#define REF_FREQ 16000000
#else
#define REF_FREQ CONFIG_CLOCK_REF_FREQ
#endif
/* The VCO likes an input of 2 MHz best */
#define PLL_INPUT (REF_FREQ % 2000000 ? 1000000 : 2000000)

_Static_assert(VCO_FREQ / PLL_INPUT <= 432 && REF_FREQ / PLL_INPUT <= 63,
               "no such multiple");

#define NEEDS_OVERDRIVE (CONFIG_CLOCK_FREQ > 168000000)

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
    RCC->APB1RSTR = RCC->APB2RSTR = RCC->AHB1RSTR = 0xffffffff;
    RCC->APB1RSTR = RCC->APB2RSTR = RCC->AHB1RSTR = 0;
}

static void raise_voltage(void)
{
    chip_enable(PWR_GATE);
    if (limits.vos)
        PWR->CR = (PWR->CR & ~PWR_CR_VOS_MASK) | limits.vos;
}

/* Above the frequency of scale 1; with the PLL on, not yet in use. */
static void enter_overdrive(void)
{
    PWR->CR |= PWR_CR_ODEN;
    while (!(PWR->CSR & PWR_CSR_ODRDY))
        ;
    PWR->CR |= PWR_CR_ODSWEN;
    while (!(PWR->CSR & PWR_CSR_ODSWRDY))
        ;
}

static void start_pll(void)
{
    uint32_t source = 0;

    if (!CONFIG_STM32_CLOCK_REF_INTERNAL) {
        RCC->CR |= RCC_CR_HSEON;
        while (!(RCC->CR & RCC_CR_HSERDY))
            ;
        source = RCC_PLLCFGR_SRC_HSE;
    }
    RCC->PLLCFGR = source | RCC_PLLCFGR_M((uint32_t)(REF_FREQ / PLL_INPUT))
        | RCC_PLLCFGR_N((uint32_t)(VCO_FREQ / PLL_INPUT))
        | RCC_PLLCFGR_P((uint32_t)limits.p)
        | RCC_PLLCFGR_Q((uint32_t)limits.q)
        | RCC_PLLCFGR_R((uint32_t)limits.r);
    RCC->CR |= RCC_CR_PLLON;
    if (NEEDS_OVERDRIVE)
        enter_overdrive();
    while (!(RCC->CR & RCC_CR_PLLRDY))
        ;
}

void board_clock_init(void)
{
    uint32_t config = limits.apb1 == 4 ? RCC_CFGR_PPRE1_4 : RCC_CFGR_PPRE1_2;

    if (limits.apb2 == 2)
        config |= RCC_CFGR_PPRE2_2;
    raise_voltage();
    start_pll();
    FLASH_ACR = limits.latency | FLASH_ACR_PRFTEN | FLASH_ACR_ICEN
        | (CONFIG_MACH_STM32F7 ? 0 : FLASH_ACR_DCEN);
    RCC->CFGR = config;
    RCC->CFGR = config | RCC_CFGR_SW_PLL;
    while ((RCC->CFGR & RCC_CFGR_SWS) != RCC_CFGR_SWS_PLL)
        ;
}
