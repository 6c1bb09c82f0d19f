/* SPDX-License-Identifier: GPL-3.0-or-later
 * 48 MHz for USB: from the PLL where it has them exactly; else from an
 * oscillator of its own, which clock recovery (CRS) tunes to the frames of the
 * host (RM0091, 7; RM0433, 9).
 */
#include "chip.h"
#include "stm32/usbfs.h"
#include "usb_clock.h"

#if defined(CRS_BASE) && !CONFIG_MACH_STM32F070
#define CRS ((struct crs_regs *)CRS_BASE)

static void start_recovery(uint32_t source)
{
    chip_enable(CRS_GATE);
    CRS->CFGR = (CRS->CFGR & ~CRS_CFGR_SYNCSRC) | source;
    CRS->CR |= CRS_CR_AUTOTRIMEN | CRS_CR_CEN;
}
#endif

#if CONFIG_MACH_STM32F070
/* The processor's clock is that of the PLL, 48 MHz of a crystal. */
void usb_clock_start(void)
{
    RCC->CFGR3 |= RCC_CFGR3_USB_PLL;
}

#elif CONFIG_MACH_STM32F0
void usb_clock_start(void)
{
    RCC->CR2 |= RCC_CR2_HSI48ON;
    while (!(RCC->CR2 & RCC_CR2_HSI48RDY))
        ;
    start_recovery(CRS_CFGR_SYNC_USB);
}

#elif CONFIG_MACH_STM32G0
void usb_clock_start(void)
{
    RCC->CR |= RCC_CR_HSI48ON;
    while (!(RCC->CR & RCC_CR_HSI48RDY))
        ;
    chip_enable(PWR_GATE);
    PWR_CR2 |= PWR_CR2_USV;
    start_recovery(CRS_CFGR_SYNC_USB);
}

#elif CONFIG_MACH_STM32G4 || CONFIG_MACH_STM32L4
void usb_clock_start(void)
{
    RCC_CRRCR |= RCC_CRRCR_HSI48ON;
    while (!(RCC_CRRCR & RCC_CRRCR_HSI48RDY))
        ;
    RCC_CCIPR &= ~RCC_CCIPR_CLK48;
#if CONFIG_MACH_STM32L4
    chip_enable(PWR_GATE);
    PWR_CR2 |= PWR_CR2_USV;
#endif
    start_recovery(CRS_CFGR_SYNC_USB);
}

#elif CONFIG_MACH_STM32H7
/* The transceiver has a supply of its own. */
void usb_clock_start(void)
{
    RCC->CR |= RCC_CR_HSI48ON;
    while (!(RCC->CR & RCC_CR_HSI48RDY))
        ;
    RCC->D2CCIP2R |= RCC_D2CCIP2R_USB_HSI48;
    /* a sleeping processor must not wait for a transceiver outside */
    RCC_AHB1LPENR &= ~RCC_AHB1LPENR_ULPI;
    PWR->CR3 |= PWR_CR3_USB33DEN;
    while (!(PWR->CR3 & PWR_CR3_USB33RDY))
        ;
    start_recovery(USB_IS_SECOND ? CRS_CFGR_SYNC_USB2 : CRS_CFGR_SYNC_USB);
}

#elif CONFIG_MACH_STM32F446
/* The main PLL makes 180 MHz, no multiple: the second one makes 192 / 4. */
#if CONFIG_STM32_CLOCK_REF_INTERNAL
#define REF_FREQ 16000000
#else
#define REF_FREQ CONFIG_CLOCK_REF_FREQ
#endif
#define SAI_INPUT (REF_FREQ % 2000000 ? 1000000 : 2000000)

void usb_clock_start(void)
{
    RCC_PLLSAICFGR = RCC_PLLSAICFGR_M((uint32_t)(REF_FREQ / SAI_INPUT))
        | RCC_PLLSAICFGR_N(192000000u / SAI_INPUT) | RCC_PLLSAICFGR_P(4);
    RCC->CR |= RCC_CR_PLLSAION;
    while (!(RCC->CR & RCC_CR_PLLSAIRDY))
        ;
    RCC_DCKCFGR2 |= RCC_DCKCFGR2_CK48_SAI;
}

#else
/* F1: 72 MHz / 1.5; F2, F4 and F7: output Q of the PLL */
void usb_clock_start(void)
{
}
#endif
