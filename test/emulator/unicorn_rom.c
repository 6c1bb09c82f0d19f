/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The system memory of an STM32: the number that no other chip has, and the
 * boot loader in ROM, which here only waits (AN2606; RM0008, 30.2; RM0433,
 * 61.1).
 */
#include <stdlib.h>
#include <string.h>

#include "unicorn_stm32.h"

enum { ROM_BASE = 0x1ff00000, ROM_SIZE = 0x100000 };
static const uint8_t unique_id[12] = { 0x30, 0xff, 0xda, 0x05, 0x4d, 0x38, 0x35,
                                       0x30, 0x29, 0x04, 0x57, 0x01 };
static uint8_t rom[ROM_SIZE] __attribute__((aligned(4096)));

static uint32_t
id_address(void)
{
    switch (chip.model->line) {
    case LINE_F0:
        return 0x1ffff7ac;
    case LINE_F1:
        return 0x1ffff7e8;
    case LINE_F2F4F7:
        return strcmp(chip.model->name, "stm32f765") ? 0x1fff7a10 : 0x1ff0f420;
    case LINE_H7:
        return 0x1ff1e800;
    default:
        return 0x1fff7590;
    }
}

/* Of the boot loader's table; 0: none that takes USB. */
static uint32_t
loader_address(void)
{
    if (!strcmp(chip.model->name, "stm32f042"))
        return 0x1fffc400;
    if (!strcmp(chip.model->name, "stm32f072"))
        return 0x1fffc800;
    if (chip.model->line == LINE_H7)
        return 0x1ff09800;
    return chip.model->line == LINE_F0 || chip.model->line == LINE_F1
        || !strcmp(chip.model->name, "stm32f207") ? 0 : 0x1fff0000;
}

void
rom_map(uc_engine *uc)
{
    uint32_t loader = loader_address(), words[3];

    memset(rom, 0xff, sizeof(rom));
    memcpy(&rom[id_address() - ROM_BASE], unique_id, sizeof(unique_id));
    /* several chips of one test are told apart by the last byte */
    if (getenv("UNICORN_ID"))
        rom[id_address() - ROM_BASE + 11] = (uint8_t)atoi(getenv("UNICORN_ID"));
    words[0] = 0x20000800;
    words[1] = loader + 9;
    words[2] = 0xe7fee7fe;      /* here: goto here */
    if (loader)
        memcpy(&rom[loader - ROM_BASE], words, sizeof(words));
    if (uc_mem_map_ptr(uc, ROM_BASE, ROM_SIZE, UC_PROT_READ | UC_PROT_EXEC,
                       rom))
        chip_fault("no system memory");
}

/* For tests: is that boot loader running, as it wants to find the chip? */
int
unicorn_is_in_rom(void)
{
    uint32_t pc = 0, sp = 0, masked = 0;

    uc_reg_read(chip.uc, UC_ARM_REG_PC, &pc);
    uc_reg_read(chip.uc, UC_ARM_REG_SP, &sp);
    uc_reg_read(chip.uc, UC_ARM_REG_PRIMASK, &masked);
    if (chip.model->line == LINE_F0 && (chip.syscfg->regs[0] & 3) != 1)
        return 0;
    if (chip.model->line != LINE_F0 && chip.vtor != loader_address())
        return 0;
    return pc == loader_address() + 8 && sp == 0x20000800 && !masked
        && chip.core_hz == chip.model->hsi_hz;
}

/* For tests: bytes of RAM, flash or backup registers; the latter by address. */
uint32_t
unicorn_peek(uint32_t addr)
{
    const struct device *backup = stm32_find(DEV_BACKUP, 0);
    uint32_t word = 0;

    if (backup && addr - backup->info->base < MAX_REGS * 4)
        return backup->regs[(addr - backup->info->base) / 4];
    uc_mem_read(chip.uc, addr, &word, 4);
    return word;
}

void
unicorn_poke(uint32_t addr, uint32_t word)
{
    uc_mem_write(chip.uc, addr, &word, 4);
}
