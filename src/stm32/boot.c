/* SPDX-License-Identifier: GPL-3.0-or-later
 * Ways into the boot loaders that boards have.
 *
 * Katapult, in flash before the program, is known by eight bytes before its
 * first instruction; it wants a number where its stack begins.  The HID boot
 * loader and that of stm32duino look into a backup register (F1, F4).  The one
 * in ROM (DFU, AN2606) is started after a reset, before anything is set up.
 */
#include <stdbool.h>
#include <string.h>

#include "armcm/boot.h"
#include "board/irq.h"
#include "board/reset.h"
#include "chip.h"

static const char katapult_signature[8] = "CanBoot!";
#define KATAPULT_REQUEST 0x5984e3fa6ca1589bull
#define BACKUP_REQUEST 0x424c
/* Any two numbers: what RAM holds by chance is another */
#define DFU_REQUEST 0x0df00df0u

#define IS_BEHIND_BOOTLOADER \
    (CONFIG_FLASH_APPLICATION_ADDRESS != CONFIG_FLASH_BASE)

extern uint32_t link_stack_start[];

static bool is_in(uint32_t addr, uint32_t base, uint32_t size)
{
    return addr - base <= size - 8 && addr % 4 == 0;
}

static void ask_katapult(void)
{
    const uint32_t *vectors = (const uint32_t *)CONFIG_FLASH_BASE;
    uint32_t signature = (vectors[1] & ~1u) - 8, stack = vectors[0];
    uint64_t request = KATAPULT_REQUEST;

    if (!is_in(signature, CONFIG_FLASH_BASE, CONFIG_FLASH_SIZE)
        || !is_in(stack, CONFIG_RAM_START, CONFIG_RAM_SIZE)
        || memcmp((const void *)signature, katapult_signature,
                  sizeof(katapult_signature)))
        return;
    irq_disable();
    memcpy((void *)stack, &request, sizeof(request));
    reset_mcu();
}

#if CONFIG_MACH_STM32F1
static void note_in_backup(void)
{
    chip_enable(PWR_GATE);
    chip_enable(BKP_GATE);
    PWR_CR |= PWR_CR_DBP;
    BKP_DR(4) = BACKUP_REQUEST;
    BKP_DR(10) = BACKUP_REQUEST;
}
#elif CONFIG_MACH_STM32F4
static void note_in_backup(void)
{
    chip_enable(PWR_GATE);
    PWR->CR |= PWR_CR_DBP;
    RTC_BKP(4) = BACKUP_REQUEST;
}
#else
static void note_in_backup(void)
{
}
#endif

void reset_to_bootloader(void)
{
    if (IS_BEHIND_BOOTLOADER) {
        ask_katapult();
        note_in_backup();
    }
    irq_disable();
    if (CONFIG_STM32_DFU_ROM_ADDRESS) {
        link_stack_start[0] = DFU_REQUEST;
        link_stack_start[1] = ~DFU_REQUEST;
    }
    reset_mcu();
}

/* Its table of interrupts is to be where the processor looks for it. */
static void map_rom(void)
{
#if CONFIG_ARMCM_VTOR
    SCB->VTOR = CONFIG_STM32_DFU_ROM_ADDRESS;
#elif CONFIG_MACH_STM32F0
    chip_enable(SYSCFG_GATE);
    SYSCFG_CFGR1 = (SYSCFG_CFGR1 & ~SYSCFG_CFGR1_MEM_RAM)
        | SYSCFG_CFGR1_MEM_SYSTEM;
#endif
}

void board_check_boot_request(void)
{
    const uint32_t *rom = (const uint32_t *)CONFIG_STM32_DFU_ROM_ADDRESS;

    if (!CONFIG_STM32_DFU_ROM_ADDRESS || link_stack_start[0] != DFU_REQUEST
        || link_stack_start[1] != ~DFU_REQUEST)
        return;
    link_stack_start[0] = 0;
    map_rom();
    __asm__ volatile("msr msp, %0\n\tcpsie i\n\tbx %1"
                     : : "r"(rom[0]), "r"(rom[1]) : "memory");
    __builtin_unreachable();
}
