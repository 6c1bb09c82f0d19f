/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a Cortex-M port's port.h includes: interrupts, sleep, the clock.
 */
#ifndef ARMCM_CPU_H
#define ARMCM_CPU_H

#include <stdint.h>
#include "armcm/core.h"

/* Into the timer interrupt, which has values in registers (events.c). */
#define ALWAYS_INLINE inline __attribute__((always_inline))

typedef uint32_t irq_flag_t;

static inline void irq_disable(void)
{
    __asm__ volatile("cpsid i" ::: "memory");
}

static inline void irq_enable(void)
{
    __asm__ volatile("cpsie i" ::: "memory");
}

static inline irq_flag_t irq_save(void)
{
    irq_flag_t flag;

    __asm__ volatile("mrs %0, primask\n\tcpsid i" : "=r"(flag) :: "memory");
    return flag;
}

static inline void irq_restore(irq_flag_t flag)
{
    __asm__ volatile("msr primask, %0" :: "r"(flag) : "memory");
}

/* A pending interrupt ends the sleep even while irqs are off.  Chips that are
 * slow to wake up wait awake; `yield` does nothing there. */
static inline void irq_wait(void)
{
#if CONFIG_ARMCM_SLOW_WAKE
    __asm__ volatile("cpsie i\n\tyield\n\tcpsid i" ::: "memory");
#else
    __asm__ volatile("wfi\n\tcpsie i\n\tisb\n\tcpsid i" ::: "memory");
#endif
}

static inline void irq_poll(void)
{
}

#if CONFIG_ARMCM_CYCLE_COUNTER
static ALWAYS_INLINE uint32_t timer_read_clock(void)
{
    return DWT->CYCCNT;
}
#endif

/* Start: memory of 2^log2_size bytes, which begins at a multiple of that, is
 * not cached from now on (CONFIG_ARMCM_CACHE). */
void armcm_uncache(volatile void *begin, uint32_t log2_size);

/* Interrupt `number` of the NVIC calls `handler` from now on. */
void armcm_connect(uint32_t number, void (*handler)(void));
/* The same for a system exception, by its place in the vector table. */
void armcm_connect_system(uint32_t vector, void (*handler)(void));

#define ARMCM_VECTOR_SYSTICK 15

/* Irqs off, before anything reads the clock. */
void armcm_timer_init(void);

/* The port's, irqs off, nothing initialised but the stack: stop what a
 * bootloader has left running; make ready to fetch from flash at speed. */
void board_early_init(void);
/* The port's, irqs off: set up the clocks. */
void board_clock_init(void);
/* The port's, where CONFIG_ARMCM_VTOR is not set: vectors are in RAM. */
void board_map_vectors(void);
/* The port's, where the processor counts no cycles (timer_read_clock() too). */
void armcm_start_counter(void);

#endif
