/* SPDX-License-Identifier: GPL-3.0-or-later
 * The flash controller: the chip's number, and the bit that says what starts
 * after a reset (11057, 18.4.3).
 *
 * While a command is under way flash is no memory for programs: these run from
 * RAM, with irqs off.
 */
#include "board/chipid.h"
#include "board/irq.h"
#include "board/reset.h"
#include "chip.h"
#include "core/sched.h"

#define EFC ((struct efc_regs *)EFC0_BASE)
#define IN_RAM __attribute__((section(".ramfunc"), noinline, long_call))

enum { CHIPID_WORDS = 4 };

static uint32_t id[CHIPID_WORDS];

/* Where flash begins, the cache knows something else. */
static inline __attribute__((always_inline)) void forget_cached(void)
{
#if CONFIG_ARMCM_CACHE
    SCB_DCIMVAC = CONFIG_FLASH_BASE;
    __asm__ volatile("dsb" ::: "memory");
#endif
}

/* The number lies where flash begins, for as long as it is asked for. */
static IN_RAM void read_id(void)
{
    uint32_t mode = EFC->FMR, i;

    EFC->FMR = mode | EFC_FMR_SCOD;
    EFC->FCR = EFC_COMMAND(EFC_START_ID, 0u);
    while (EFC->FSR & EFC_FSR_FRDY)
        ;
    forget_cached();
    for (i = 0; i < CHIPID_WORDS; i++)
        id[i] = ((volatile uint32_t *)CONFIG_FLASH_BASE)[i];
    EFC->FCR = EFC_COMMAND(EFC_STOP_ID, 0u);
    while (!(EFC->FSR & EFC_FSR_FRDY))
        ;
    forget_cached();
    EFC->FMR = mode;
}

static IN_RAM void choose_boot_rom(void)
{
    EFC->FCR = EFC_COMMAND(EFC_CLEAR_GPNVM, GPNVM_BOOT_FLASH);
    while (!(EFC->FSR & EFC_FSR_FRDY))
        ;
}

void chipid_init(void)
{
    irq_flag_t flag = irq_save();

    read_id();
    irq_restore(flag);
}
DECL_INIT(chipid_init);

const uint8_t *chipid_get(uint8_t *len)
{
    *len = sizeof(id);
    return (const uint8_t *)id;
}

/* SAM-BA, which bossac talks to */
void reset_to_bootloader(void)
{
    irq_disable();
    choose_boot_rom();
    reset_mcu();
}
