/* SPDX-License-Identifier: GPL-3.0-or-later
 * Start, memory, watchdog and reset. */
#include <avr/power.h>
#include <avr/wdt.h>

#include "board/irq.h"
#include "board/mem.h"
#include "board/reset.h"
#include "board/watchdog.h"
#include "core/sched.h"

extern char __bss_end;

/* A watchdog that caused the reset still runs, with the shortest time. */
__attribute__((naked, used, section(".init3")))
void avr_stop_watchdog(void)
{
    MCUSR = 0;
    wdt_disable();
}

int main(void)
{
#if CONFIG_CLEAR_PRESCALER
    clock_prescale_set(clock_div_1);
#endif
#ifdef JTD
    MCUCR |= 1 << JTD; /* its pins are ordinary ones; written twice */
    MCUCR |= 1 << JTD;
#endif
    SMCR = 1 << SE; /* sleep means idle */
    sched_main();
}

void *mem_get_arena(size_t *size)
{
    uintptr_t start = ((uintptr_t)&__bss_end + 3) & ~(uintptr_t)3;

    *size = RAMEND + 1u - CONFIG_STACK_SIZE - start;
    return (void *)start;
}

uint32_t mem_debug_read(uint8_t order, uint32_t addr)
{
    uintptr_t p = (uintptr_t)addr;

    if (order == 0)
        return *(volatile uint8_t *)p;
    if (order == 1)
        return *(volatile uint16_t *)p;
    return *(volatile uint32_t *)p;
}

void mem_debug_write(uint8_t order, uint32_t addr, uint32_t val)
{
    uintptr_t p = (uintptr_t)addr;

    if (order == 0)
        *(volatile uint8_t *)p = (uint8_t)val;
    else if (order == 1)
        *(volatile uint16_t *)p = (uint16_t)val;
    else
        *(volatile uint32_t *)p = val;
}

void reset_mcu(void)
{
    irq_disable();
    wdt_enable(WDTO_15MS);
    for (;;)
        ;
}

void watchdog_init(void)
{
    wdt_enable(WDTO_500MS);
}
DECL_INIT(watchdog_init);

void watchdog_pet(void)
{
    wdt_reset();
}
