/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clocks of the LPC176x: 100 or 120 MHz, and 48 MHz for USB, from a crystal of
 * 12 MHz (UM10360, chapter 4). */
#include "armcm/cpu.h"
#include "board/irq.h"
#include "chip.h"
#include "core/decl.h"

#define CRYSTAL_FREQ 12000000u

/* FCCO of PLL0: 275 to 550 MHz, twice the crystal times M by N */
#define CORE_DIVIDER 3
#define PLL0_M (CONFIG_MACH_LPC1769 ? 15u : 25u)
#define PLL0_N (CONFIG_MACH_LPC1769 ? 1u : 2u)
_Static_assert(2 * CRYSTAL_FREQ / PLL0_N * PLL0_M / CORE_DIVIDER
               == CONFIG_CLOCK_FREQ, "no such multiple");

/* FCCO of PLL1: 156 to 320 MHz, 48 MHz times 2 P */
#define PLL1_M 4u
#define PLL1_LOG2_P 1u

/* A fetch takes five clocks up to 100 MHz, of an LPC1769 up to 120 MHz */
#define FLASH_CLOCKS 5

static void feed_pll0(void)
{
    SYSCON->PLL0FEED = 0xaa;
    SYSCON->PLL0FEED = 0x55;
}

static void feed_pll1(void)
{
    SYSCON->PLL1FEED = 0xaa;
    SYSCON->PLL1FEED = 0x55;
}

static void stop_plls(void)
{
    SYSCON->PLL0CON &= PLLCON_ENABLE;
    feed_pll0();
    SYSCON->PLL0CON = 0;
    feed_pll0();
    SYSCON->PLL1CON &= PLLCON_ENABLE;
    feed_pll1();
    SYSCON->PLL1CON = 0;
    feed_pll1();
}

/* Every pin an input with a pull-up, as after reset. */
static void free_pins(void)
{
    uint32_t i;

    for (i = 0; i < 10; i++)
        PINCONNECT->PINSEL[i] = PINCONNECT->PINMODE[i] = 0;
    for (i = 0; i < 5; i++) {
        struct gpio_regs *port = (struct gpio_regs *)(GPIO_BASE + 0x20 * i);

        PINCONNECT->PINMODE_OD[i] = 0;
        port->DIR = 0;
        port->MASK = 0;
    }
}

/* Back to the internal oscillator; no peripheral can be reset, so they lose
 * their clocks and their pins.  The clocks of peripherals must be chosen while
 * PLL0 is off (ES_LPC176x, PCLKSELx.1). */
void board_early_init(void)
{
    stop_plls();
    SYSCON->CLKSRCSEL = CLKSRCSEL_IRC;
    SYSCON->CCLKCFG = 0;
    SYSCON->PCLKSEL0 = PCLKSEL0_CORE;
    SYSCON->PCLKSEL1 = PCLKSEL1_CORE;
    free_pins();
    SYSCON->PCONP = PCONP_RESET & ~(1u << UART0_POWER | 1u << UART1_POWER
                                    | 1u << PWM1_POWER);
}

static void start_pll0(void)
{
    SYSCON->CLKSRCSEL = CLKSRCSEL_MAIN;
    SYSCON->PLL0CFG = PLL0CFG(PLL0_M, PLL0_N);
    feed_pll0();
    SYSCON->PLL0CON = PLLCON_ENABLE;
    feed_pll0();
    SYSCON->CCLKCFG = CORE_DIVIDER - 1;
    while (!(SYSCON->PLL0STAT & PLL0STAT_LOCK))
        ;
    SYSCON->PLL0CON = PLLCON_ENABLE | PLLCON_CONNECT;
    feed_pll0();
    while ((SYSCON->PLL0STAT & PLL0STAT_CONNECTED) != PLL0STAT_CONNECTED)
        ;
}

static void start_pll1(void)
{
    SYSCON->PLL1CFG = PLL1CFG(PLL1_M, PLL1_LOG2_P);
    feed_pll1();
    SYSCON->PLL1CON = PLLCON_ENABLE;
    feed_pll1();
    while (!(SYSCON->PLL1STAT & PLL1STAT_LOCK))
        ;
    SYSCON->PLL1CON = PLLCON_ENABLE | PLLCON_CONNECT;
    feed_pll1();
    while ((SYSCON->PLL1STAT & PLL1STAT_CONNECTED) != PLL1STAT_CONNECTED)
        ;
}

void board_clock_init(void)
{
    SYSCON->SCS = SCS_OSCEN;
    while (!(SYSCON->SCS & SCS_OSCSTAT))
        ;
    SYSCON->FLASHCFG = FLASHCFG_RESERVED | FLASHCFG_CLOCKS(FLASH_CLOCKS);
    start_pll0();
    if (CONFIG_WANT_USB_DEVICE)
        start_pll1();
}

void chip_enable(uint32_t power_bit)
{
    irq_flag_t flag = irq_save();

    SYSCON->PCONP |= 1u << power_bit;
    irq_restore(flag);
}
