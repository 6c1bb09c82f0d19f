/* SPDX-License-Identifier: GPL-3.0-or-later
 * From reset to sched_main(), and the table of interrupts.
 *
 * The table that counts lies in RAM: handlers connect themselves, and the
 * processor fetches them without wait states.  The one in flash serves until
 * then and for faults.
 */
#include <stddef.h>
#include <string.h>

#include "armcm/boot.h"
#include "board/irq.h"
#include "board/mem.h"
#include "board/reset.h"
#include "core/sched.h"

#define N_SYSTEM 16

extern uint32_t link_data_start[], link_data_end[], link_data_load[];
extern uint32_t link_bss_start[], link_bss_end[];
extern uint32_t link_stack_start[], link_stack_top[];

typedef void (*vector_t)(void);

/* First in RAM: its address must be a multiple of its size. */
static vector_t vectors[N_SYSTEM + CONFIG_ARMCM_IRQS]
    __attribute__((section(".ramvectors"), used));

/* A fault, or an interrupt that nobody asked for: pins float after a reset,
 * and the host is told so. */
static void unexpected(void)
{
    reset_mcu();
}

void armcm_connect_system(uint32_t vector, void (*handler)(void))
{
    vectors[vector] = handler;
}

void armcm_connect(uint32_t number, void (*handler)(void))
{
    vectors[N_SYSTEM + number] = handler;
    NVIC->ISER[number / 32] = 1u << (number % 32);
}

/* What a bootloader may have left on. */
static void silence(void)
{
    uint32_t i;

    SYSTICK->CSR = 0;
    SCB->ICSR = SCB_ICSR_PENDSTCLR;
    for (i = 0; i < (CONFIG_ARMCM_IRQS + 31) / 32; i++) {
        NVIC->ICER[i] = 0xffffffff;
        NVIC->ICPR[i] = 0xffffffff;
    }
}

static void init_memory(void)
{
    uint32_t *to = link_data_start, i;
    const uint32_t *from = link_data_load;

    while (to < link_data_end)
        *to++ = *from++;
    for (to = link_bss_start; to < link_bss_end; to++)
        *to = 0;
    for (i = 0; i < sizeof(vectors) / sizeof(vectors[0]); i++)
        vectors[i] = unexpected;
    vectors[0] = (vector_t)link_stack_top;
}

#if CONFIG_ARMCM_CACHE
/* Both caches start with nothing in them (DDI 0403E B2.2.7). */
static void enable_caches(void)
{
    uint32_t set, way, size;

    if (SCB->CCR & SCB_CCR_DC)
        return;
    SCB_CSSELR = 0;
    __asm__ volatile("dsb" ::: "memory");
    size = SCB_CCSIDR;
    for (set = 0; set <= ((size >> 13) & 0x7fff); set++)
        for (way = 0; way < 4; way++)
            SCB_DCISW = way << 30 | set << 5;
    SCB_ICIALLU = 0;
    __asm__ volatile("dsb\n\tisb" ::: "memory");
    SCB->CCR |= SCB_CCR_IC | SCB_CCR_DC;
    __asm__ volatile("dsb\n\tisb" ::: "memory");
}
#endif

static void use_ram_vectors(void)
{
#if CONFIG_ARMCM_VTOR
    SCB->VTOR = (uint32_t)vectors;
#else
    board_map_vectors();
#endif
    __asm__ volatile("dsb\n\tisb" ::: "memory");
}

static __attribute__((used, noreturn)) void start(void)
{
    silence();
    board_early_init();
#if CONFIG_ARMCM_BOOT_REQUEST
    board_check_boot_request();
#endif
    init_memory();
    use_ram_vectors();
    board_clock_init();
#if CONFIG_ARMCM_CACHE
    enable_caches();
#endif
    armcm_timer_init();
    sched_main();
}

/* A bootloader's stack may lie where ours has variables. */
__attribute__((naked, used, noreturn)) void armcm_reset(void)
{
    __asm__ volatile(
        "cpsid i\n\t"
        "movs r0, #0\n\t"
        "msr control, r0\n\t"
        "isb\n\t"
        "ldr r0, =link_stack_top\n\t"
        "mov sp, r0\n\t"
        "bl %c0\n\t"
        ".ltorg" :: "i"(start));
}

static const vector_t boot_vectors[N_SYSTEM]
    __attribute__((section(".vectors"), used)) = {
    (vector_t)link_stack_top, armcm_reset, unexpected, unexpected,
    unexpected, unexpected, unexpected, NULL, NULL, NULL, NULL,
    unexpected, unexpected, NULL, unexpected, unexpected,
};

/* A shutdown within an interrupt leaves it for the main loop, which the
 * processor must know: return from the exception to the next line. */
void armcm_leave_handler(void)
{
    uint32_t number, frame_pc;

    __asm__ volatile("mrs %0, ipsr" : "=r"(number));
    if (!(number & 0x1ff))
        return;
    __asm__ volatile(
        "sub sp, #32\n\t"
        "ldr %0, =1f\n\t"
        "str %0, [sp, #24]\n\t"     /* pc */
        "ldr %0, =0x01000000\n\t"
        "str %0, [sp, #28]\n\t"     /* xpsr: thumb */
        "ldr %0, =0xfffffff9\n\t"   /* to thread mode, main stack */
        "bx %0\n\t"
        ".ltorg\n\t"
        ".balign 4\n"
        "1:"
        : "=&l"(frame_pc) :
        : "r0", "r1", "r2", "r3", "r12", "lr", "cc", "memory");
}
DECL_SHUTDOWN(armcm_leave_handler);

#if !CONFIG_ARMCM_OWN_RESET
void reset_mcu(void)
{
    irq_disable();
    __asm__ volatile("dsb" ::: "memory");
    SCB->AIRCR = SCB_AIRCR_RESET;
    for (;;)
        ;
}
#endif

void *mem_get_arena(size_t *size)
{
    *size = (size_t)((char *)link_stack_start - (char *)link_bss_end);
    return link_bss_end;
}
