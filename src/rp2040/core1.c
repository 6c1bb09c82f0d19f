/* SPDX-License-Identifier: GPL-3.0-or-later
 * Start of the second core (RP2040 data sheet, 2.8.2; RP2350 data sheet, 5.3),
 * and bells between the two (2.3.1.4; 3.1.5). */
#include "chip.h"
#include "core1.h"

#define FIFO ((struct fifo_regs *)(SIO_BASE + 0x50))

static void drain(void)
{
    while (FIFO->ST & FIFO_ST_VALID)
        (void)FIFO->RD;
}

/* The boot ROM echoes each word; one that is not echoed starts all over. */
void core1_start(void (*program)(void), uint32_t *stack_top)
{
    const uint32_t words[] = { 0, 0, 1, (uint32_t)(uintptr_t)SCB->VTOR,
                               (uint32_t)(uintptr_t)stack_top,
                               (uint32_t)(uintptr_t)program };
    uint32_t i = 0;

    while (i < sizeof(words) / sizeof(words[0])) {
        if (!words[i]) {
            drain();
            __asm__ volatile("sev");
        }
        FIFO->WR = words[i];
        __asm__ volatile("sev");
        while (!(FIFO->ST & FIFO_ST_VALID))
            ;
        i = FIFO->RD == words[i] ? i + 1 : 0;
    }
}

void core1_ring(void)
{
    __asm__ volatile("dmb" ::: "memory");
    if (FIFO->ST & FIFO_ST_READY)
        FIFO->WR = 1;
}

void core1_answer(void)
{
    drain();
    FIFO->ST = FIFO_ST_ERRORS;
}
