/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Exceptions, NVIC, SysTick and the cycle counter (ARM DDI 0403E, chapter B).
 * All interrupts have the same priority: that of reset.
 */
#include <string.h>

#include "unicorn_chip.h"

#define SCS_BASE 0xe000e000u
#define DWT_BASE 0xe0001000u
#define XPSR_THUMB (1u << 24)
#define XPSR_ALIGNED (1u << 9)
#define XPSR_IT ((3u << 25) | (0x3fu << 10))
#define EXC_RETURN 0xfffffff9u
#define SYSRESETREQ 0x05fa0004u
/* ARM DDI 0337, 5.2: twelve, with memory that does not wait */
#define ENTRY_CYCLES 12

static uint32_t
read_reg(int id)
{
    uint32_t value = 0;

    uc_reg_read(chip.uc, id, &value);
    return value;
}

static void
write_reg(int id, uint32_t value)
{
    uc_reg_write(chip.uc, id, &value);
}

static uint32_t
read_word(uint32_t addr)
{
    uint32_t value = 0;

    uc_mem_read(chip.uc, addr, &value, 4);
    return value;
}

/*
 * How long interrupts wait
 */

enum { OPCODE_CPSID = 0xb672, OPCODE_CPSIE = 0xb662, OPCODE_MSR = 0xf380 };

static void
switch_irqs(bool on)
{
    if (!on && chip.off_since == NEVER)
        chip.off_since = chip.cycle;
    if (!on || chip.off_since == NEVER)
        return;
    if (chip.cycle - chip.off_since > chip.delays.off_cycles)
        chip.delays.off_cycles = chip.cycle - chip.off_since;
    chip.off_since = NEVER;
}

void
core_note_mask(uint16_t opcode)
{
    if (opcode == OPCODE_CPSID || opcode == OPCODE_CPSIE)
        switch_irqs(opcode == OPCODE_CPSIE);
    else if ((opcode & 0xfff0) == OPCODE_MSR)
        chip.has_set_mask = true;
}

void
core_read_mask(void)
{
    chip.has_set_mask = false;
    switch_irqs(!(read_reg(UC_ARM_REG_PRIMASK) & 1));
}

static void
note_irq_end(void)
{
    struct delays *d = &chip.delays;
    uint64_t cycles = chip.cycle - chip.irq_begin;
    uint64_t size = chip.n_irq_instructions - chip.irq_first;

    if (cycles > d->irq_cycles)
        d->irq_cycles = cycles;
    if (!chip.in_handler)
        return;
    if (size > d->max_timer)
        d->max_timer = size;
    if (!d->min_timer || size < d->min_timer)
        d->min_timer = size;
}

/*
 * Interrupts
 */

static void
count_pending(void)
{
    uint32_t i;

    chip.n_pending = 0;
    for (i = VECTOR_SYSTICK; i < N_VECTORS; i++)
        chip.n_pending += chip.pending[i] && chip.enabled[i];
    if (chip.n_pending)
        chip.check_irqs = true;
}

void
core_set_pending(uint32_t vector, bool on)
{
    if (chip.pending[vector] == on)
        return;
    chip.pending[vector] = on;
    count_pending();
}

void
core_set_level(uint32_t vector, bool on)
{
    if (chip.level[vector] != on)
        chip.n_levels += on ? 1 : -1u;
    chip.level[vector] = on;
    core_set_pending(vector, on);
}

/* The handler has not silenced what called it. */
static void
repeat_levels(void)
{
    uint32_t i;

    for (i = 16; chip.n_levels && i < N_VECTORS; i++)
        if (chip.level[i])
            chip.pending[i] = true;
    if (chip.n_levels)
        count_pending();
}

static bool
is_in_handler(void)
{
    return (read_reg(UC_ARM_REG_XPSR) & 0x1ff) != 0;
}

bool
core_has_irq(void)
{
    return chip.n_pending && !(read_reg(UC_ARM_REG_PRIMASK) & 1)
        && !is_in_handler() && !(read_reg(UC_ARM_REG_XPSR) & XPSR_IT);
}

static uint32_t
find_irq(void)
{
    uint32_t i = VECTOR_SYSTICK;

    while (!chip.pending[i] || !chip.enabled[i])
        i++;
    return i;
}

void
core_take_irq(void)
{
    uint32_t vector = find_irq(), sp = read_reg(UC_ARM_REG_SP);
    uint32_t xpsr = read_reg(UC_ARM_REG_XPSR), frame[8], entry;

    if (sp & 4) {
        sp -= 4;
        xpsr |= XPSR_ALIGNED;
    }
    frame[0] = read_reg(UC_ARM_REG_R0);
    frame[1] = read_reg(UC_ARM_REG_R1);
    frame[2] = read_reg(UC_ARM_REG_R2);
    frame[3] = read_reg(UC_ARM_REG_R3);
    frame[4] = read_reg(UC_ARM_REG_R12);
    frame[5] = read_reg(UC_ARM_REG_LR);
    frame[6] = read_reg(UC_ARM_REG_PC);
    frame[7] = xpsr | XPSR_THUMB;
    sp -= 32;
    if (uc_mem_write(chip.uc, sp, frame, sizeof(frame)))
        chip_fault("stack of an interrupt outside of memory: 0x%08x", sp);
    /* a Cortex-M0 has its vectors at 0, where flash or RAM may be */
    if (chip.model->line == LINE_F0)
        chip.vtor = (chip.syscfg->regs[0] & 3) == 3 ? chip.model->ram_base
            : 0x08000000;
    entry = read_word(chip.vtor + 4 * vector);
    if (!(entry & 1))
        chip_fault("vector %u is no thumb code: 0x%08x", vector, entry);
    chip.pending[vector] = false;
    count_pending();
    write_reg(UC_ARM_REG_SP, sp);
    write_reg(UC_ARM_REG_LR, EXC_RETURN);
    write_reg(UC_ARM_REG_XPSR, XPSR_THUMB | vector);
    write_reg(UC_ARM_REG_PC, entry);
    chip.irq_begin = chip.cycle;
    chip.irq_first = chip.n_irq_instructions;
    chip.cycle += ENTRY_CYCLES;
    chip.in_handler = vector == (chip.model->family->timer_vector
                                 ? chip.model->family->timer_vector
                                 : VECTOR_SYSTICK);
    chip.n_timer_irqs += chip.in_handler;
}

bool
core_end_irq(uint32_t pc)
{
    uint32_t sp = read_reg(UC_ARM_REG_SP), frame[8];

    if ((pc | 1) != EXC_RETURN || !is_in_handler())
        return false;
    if (uc_mem_read(chip.uc, sp, frame, sizeof(frame)))
        chip_fault("stack of an interrupt outside of memory: 0x%08x", sp);
    sp += 32 + (frame[7] & XPSR_ALIGNED ? 4 : 0);
    write_reg(UC_ARM_REG_R0, frame[0]);
    write_reg(UC_ARM_REG_R1, frame[1]);
    write_reg(UC_ARM_REG_R2, frame[2]);
    write_reg(UC_ARM_REG_R3, frame[3]);
    write_reg(UC_ARM_REG_R12, frame[4]);
    write_reg(UC_ARM_REG_LR, frame[5]);
    write_reg(UC_ARM_REG_XPSR, frame[7] & ~(0x1ffu | XPSR_ALIGNED));
    write_reg(UC_ARM_REG_SP, sp);
    write_reg(UC_ARM_REG_PC, frame[6] | 1);
    repeat_levels();
    chip.check_irqs = chip.n_pending != 0;
    note_irq_end();
    chip.in_handler = false;
    return true;
}

/*
 * SysTick
 */

static void
plan_systick(uint64_t zero)
{
    chip.systick_zero = zero;
    chip.systick_due = chip.systick_csr & 1 && chip.systick_rvr
        ? zero + chip.systick_rvr + 1 : NEVER;
    chip_wake_at(chip.systick_due);
}

void
core_run_events(void)
{
    if (chip.cycle < chip.systick_due)
        return;
    if (chip.systick_csr & 2)
        core_set_pending(VECTOR_SYSTICK, true);
    chip.systick_csr |= 1u << 16;
    plan_systick(chip.systick_due);
}

uint64_t
core_next_event(void)
{
    return chip.systick_due;
}

/*
 * Registers
 */

static uint32_t
read_nvic(uint32_t offset, const uint8_t *flags)
{
    uint32_t i, word = 0, first = 16 + (offset & 0x7f) * 8;

    for (i = 0; i < 32 && first + i < N_VECTORS; i++)
        word |= (uint32_t)flags[first + i] << i;
    return word;
}

static void
write_nvic(uint32_t offset, uint8_t *flags, uint32_t bits, bool on)
{
    uint32_t i, first = 16 + (offset & 0x7f) * 8;

    for (i = 0; i < 32 && first + i < N_VECTORS; i++)
        if (bits & (1u << i))
            flags[first + i] = on;
    count_pending();
}

static uint32_t
read_system(uint32_t offset)
{
    uint64_t left;

    switch (offset) {
    case 0x010:
        return chip.systick_csr;
    case 0x014:
        return chip.systick_rvr;
    case 0x018:
        left = chip.systick_due - chip.cycle;
        return chip.systick_due == NEVER ? 0 : (uint32_t)left & 0xffffff;
    case 0xd08:
        return chip.vtor;
    case 0xd14:
        return chip.ccr;
    case 0xd80:
        return 0xf01fe019;      /* 16 KiB, 4 ways of 128 lines */
    case 0xdfc:
        return chip.demcr;
    default:
        return 0;
    }
}

static uint64_t
scs_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    uint32_t group = (uint32_t)offset & 0xf80;

    (void)uc;
    (void)size;
    (void)param;
    if (group == 0x100 || group == 0x180)
        return read_nvic((uint32_t)offset, chip.enabled);
    if (group == 0x200 || group == 0x280)
        return read_nvic((uint32_t)offset, chip.pending);
    return read_system((uint32_t)offset);
}

static void
write_systick_csr(uint32_t value)
{
    bool starts = value & 1 && !(chip.systick_csr & 1);

    chip.systick_csr = value & 7;
    chip.enabled[VECTOR_SYSTICK] = true;
    if (starts)
        plan_systick(chip.cycle);
    else if (!(value & 1))
        chip.systick_due = NEVER;
}

static void
write_region(uint32_t rasr)
{
    uint32_t size = 2u << (rasr >> 1 & 31);

    if (rasr & 1 && (size < 32 || chip.mpu_rbar[chip.mpu_number] % size))
        chip_fault("MPU region of %u bytes at 0x%08x", size,
                   chip.mpu_rbar[chip.mpu_number]);
    chip.mpu_rasr[chip.mpu_number] = rasr;
}

/* The last region that has the address counts; TEX, C, B: 001 0 0 is plain
 * memory, not cached. */
bool
core_is_cached(uint32_t address)
{
    uint32_t i;

    if (!(chip.ccr & 1u << 16))
        return false;
    for (i = 8; chip.mpu_ctrl & 1 && i-- > 0;) {
        uint32_t rasr = chip.mpu_rasr[i], size = 2u << (rasr >> 1 & 31);

        if (rasr & 1 && address - chip.mpu_rbar[i] < size)
            return (rasr >> 16 & 0x3b) != 8;
    }
    return true;
}

static void
write_system(uint32_t offset, uint32_t value)
{
    switch (offset) {
    case 0x010:
        write_systick_csr(value);
        return;
    case 0x014:
        chip.systick_rvr = value & 0xffffff;
        return;
    case 0x018:
        chip.systick_csr &= 7;
        plan_systick(chip.cycle);
        return;
    case 0xd04:
        if (value & (1u << 26))
            core_set_pending(VECTOR_SYSTICK, true);
        if (value & (1u << 25))
            core_set_pending(VECTOR_SYSTICK, false);
        return;
    case 0xd08:
        chip.vtor = value;
        return;
    case 0xd0c:
        if (value == SYSRESETREQ)
            chip.wants_reset = true;
        chip_wake_at(chip.cycle);
        return;
    case 0xd14:
        chip.ccr = value;
        return;
    case 0xd94:
        chip.mpu_ctrl = value;
        if (value == 1)
            chip_fault("MPU without the rest of the memory");
        return;
    case 0xd98:
        chip.mpu_number = value & 7;
        return;
    case 0xd9c:
        chip.mpu_rbar[chip.mpu_number] = value;
        return;
    case 0xda0:
        write_region(value);
        return;
    case 0xdfc:
        chip.demcr = value;
        return;
    default:
        return;
    }
}

static void
scs_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
          void *param)
{
    uint32_t group = (uint32_t)offset & 0xf80, word = (uint32_t)value;

    (void)uc;
    (void)size;
    (void)param;
    if (group == 0x100 || group == 0x180)
        write_nvic((uint32_t)offset, chip.enabled, word, group == 0x100);
    else if (group == 0x200 || group == 0x280)
        write_nvic((uint32_t)offset, chip.pending, word, group == 0x200);
    else
        write_system((uint32_t)offset, word);
}

static uint64_t
dwt_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    (void)uc;
    (void)size;
    (void)param;
    if (offset == 0)
        return chip.dwt_ctrl;
    if (offset == 4 && chip.dwt_ctrl & 1)
        return (uint32_t)(chip.cycle - chip.cyccnt_zero);
    return 0;
}

static void
dwt_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
          void *param)
{
    (void)uc;
    (void)size;
    (void)param;
    if (offset == 4)
        chip.cyccnt_zero = chip.cycle - (uint32_t)value;
    if (offset != 0 || !(chip.demcr & (1u << 24)))
        return;
    chip.dwt_ctrl = (uint32_t)value;
    if (value & 1) {
        chip.cyccnt_zero = chip.cycle;
        chip.is_counting = true;
        chip_wake_at(chip.cycle);
    }
}

void
core_map(uc_engine *uc)
{
    if (uc_mmio_map(uc, SCS_BASE, 0x1000, scs_read, NULL, scs_write, NULL)
        || uc_mmio_map(uc, DWT_BASE, 0x1000, dwt_read, NULL, dwt_write, NULL))
        chip_fault("no registers of the core");
}

void
core_reset(void)
{
    chip.systick_due = chip.off_since = NEVER;
    chip.vtor = chip.model->family->flash_base;
    memset(chip.pending, 0, sizeof(chip.pending));
    memset(chip.enabled, 0, sizeof(chip.enabled));
}
