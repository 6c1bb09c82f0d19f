/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * An RP2040's boot ROM, the interface of its flash chip, and that chip (data
 * sheet, 2.8 and 4.10): flash is memory only while the interface has been told
 * a command by which this chip can be read.
 */
#include <string.h>

#include "unicorn_rp2040.h"

#define FLASH_BASE 0x10000000u
#define SSI_BASE 0x18000000u
#define SCS_SELECT 3            /* word of IO_QSPI that controls the select */
enum { BOOT2_SIZE = 256, BOOT2_OFFSET = 0x41f00 };
/* Words */
enum { CTRLR0 = 0, SSIENR = 2, SER = 4, BAUDR = 5, RXFLR = 9, SR = 10,
       DR0 = 24, SPI_CTRLR0 = 61 };

/* rom_table_lookup() for any code, and what it finds: one that tells us. */
static const uint16_t rom_code[] = {
    0x4801, 0x4770, 0x46c0, 0x46c0,         /* ldr r0, [pc, #4]; bx lr */
    0x0211, 0x0000, 0, 0,                   /* 0x210 + 1 */
    0x4b01, 0x6018, 0xe7fe, 0x46c0,         /* ldr r3, [pc, #4]; str; b . */
    0xf000, 0x40ff,
};
enum { ROM_CODE_AT = 0x200 };

static uint32_t ssi[64];
static struct rp_fifo answers;
static uint32_t n_in_command;
static uint8_t command;
static bool is_mapped;
static const uint8_t flash_id[8] = { 0xe6, 0x61, 0x38, 1, 2, 3, 4, 0x2f };

/* Can the chip be read with these settings? */
static bool
is_readable(void)
{
    uint32_t setup = ssi[SPI_CTRLR0];

    if (ssi[CTRLR0] == (31u << 16 | 3u << 8))
        return setup == (0x03u << 24 | 2u << 8 | 6u << 2);
    return ssi[CTRLR0] == (1u << 21 | 31u << 16 | 3u << 8)
        && setup == (0x3bu << 24 | 8u << 11 | 2u << 8 | 6u << 2);
}

static void
set_enabled(bool on)
{
    if (is_mapped)
        uc_mem_unmap(chip.uc, FLASH_BASE, chip.model->flash_size);
    is_mapped = on && is_readable();
    if (is_mapped)
        chip_map_flash();
    memset(&answers, 0, sizeof(answers));
}

/* The chip sends a byte for each that it gets while it is selected. */
static uint8_t
exchange_byte(uint8_t byte)
{
    bool is_selected = (rp.regs[RP_IO_QSPI][SCS_SELECT] >> 8 & 3) == 2;
    uint32_t at;

    if (!is_selected) {
        chip_fault("the flash chip is not selected");
        return 0xff;
    }
    at = n_in_command++;
    if (at == 0)
        command = byte;
    return command == 0x4b && at >= 5 && at < 13 ? flash_id[at - 5] : 0xff;
}

static void
ssi_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
          void *param)
{
    uint32_t word = (uint32_t)offset / 4;

    (void)uc;
    (void)size;
    (void)param;
    if (word >= 64)
        return;
    if (word == DR0) {
        if (ssi[CTRLR0] >> 16 != 7 || !(ssi[SER] & 1) || !ssi[SSIENR]
            || ssi[BAUDR] < 4 || answers.count >= 16) {
            chip_fault("the flash interface is not ready for commands");
            return;
        }
        answers.data[answers.count++] = exchange_byte((uint8_t)value);
        return;
    }
    if (word != SSIENR && ssi[SSIENR])
        chip_fault("the flash interface is changed while it is on");
    if (word == SSIENR && !value)
        n_in_command = 0;
    ssi[word] = (uint32_t)value;
    if (word == SSIENR)
        set_enabled(value & 1);
}

static uint64_t
ssi_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    uint32_t word = (uint32_t)offset / 4;

    (void)uc;
    (void)size;
    (void)param;
    if (word == SR)
        return answers.count > answers.first ? 8 : 0;
    if (word == DR0)
        return answers.data[answers.first++ % RP_FIFO];
    return word < 64 ? ssi[word] : 0;
}

void
rp_flash_map(uc_engine *uc)
{
    uint8_t rom[0x1000] = { 0 };
    uint16_t words[2] = { 0, ROM_CODE_AT | 1 };

    /* an RP2350 has no tables before its look-up */
    memcpy(rom + (strcmp(chip.model->name, "rp2350") ? 0x16 : 0x14), words,
           sizeof(words));
    memcpy(rom + ROM_CODE_AT, rom_code, sizeof(rom_code));
    if (uc_mem_map(uc, 0, sizeof(rom), UC_PROT_READ | UC_PROT_EXEC)
        || uc_mem_write(uc, 0, rom, sizeof(rom))
        || uc_mmio_map(uc, SSI_BASE, 0x1000, ssi_read, NULL, ssi_write, NULL))
        chip_fault("no boot ROM");
    memset(ssi, 0, sizeof(ssi));
    is_mapped = false;
    n_in_command = 0;
}

/* Bit by bit, highest first. */
static uint32_t
checksum(const uint8_t *data, uint32_t len)
{
    uint32_t crc = UINT32_MAX, bit;

    for (; len--; data++)
        for (bit = 0x80; bit; bit >>= 1)
            crc = crc << 1
                ^ (!!(crc >> 31) != !!(*data & bit) ? 0x04c11db7 : 0);
    return crc;
}

static void
start_at(uint32_t pc, uint32_t sp)
{
    uint32_t lr = 0;

    uc_reg_write(chip.uc, UC_ARM_REG_SP, &sp);
    uc_reg_write(chip.uc, UC_ARM_REG_LR, &lr);
    uc_reg_write(chip.uc, UC_ARM_REG_PC, &pc);
}

/* An RP2350 looks for a block that describes a program for a secure ARM in the
 * first 4 KiB, and starts by the table at its begin (5.9.5). */
static void
boot_2350(uint32_t start)
{
    static const uint32_t block[] = { 0xffffded3, 0x10210142, 0x000001ff, 0,
                                      0xab123579 };
    uint32_t offset = start - FLASH_BASE, words[2], i;

    for (i = 0; i < 0x1000; i += 4)
        if (!memcmp(chip.flash + offset + i, block, sizeof(block)))
            break;
    if (i == 0x1000)
        chip_fault("no description of a program in flash");
    chip_map_flash();
    memcpy(words, chip.flash + offset, sizeof(words));
    start_at(words[1], words[0]);
}

/* The second stage runs from RAM if its checksum is right; a program behind a
 * boot loader finds flash readable. */
void
rp_flash_boot(uint32_t start)
{
    uint32_t sum, words[2];

    if (rp.is_2350) {
        boot_2350(start);
        return;
    }
    if (start != FLASH_BASE) {
        ssi[CTRLR0] = 31u << 16 | 3u << 8;
        ssi[SPI_CTRLR0] = 0x03u << 24 | 2u << 8 | 6u << 2;
        ssi[SER] = ssi[SSIENR] = 1;
        set_enabled(true);
        memcpy(words, chip.flash + (start - FLASH_BASE), sizeof(words));
        start_at(words[1], words[0]);
        return;
    }
    memcpy(&sum, chip.flash + BOOT2_SIZE - 4, 4);
    if (checksum(chip.flash, BOOT2_SIZE - 4) != sum) {
        chip_fault("second boot stage with a wrong checksum");
        return;
    }
    memcpy(chip.ram + BOOT2_OFFSET, chip.flash, BOOT2_SIZE);
    start_at(chip.model->ram_base + BOOT2_OFFSET + 1,
             chip.model->ram_base + BOOT2_OFFSET);
}
