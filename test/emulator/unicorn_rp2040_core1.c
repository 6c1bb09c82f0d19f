/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The second core sleeps in the boot ROM until the words come that start it
 * (RP2040 data sheet, 2.8.2; 2.3.1.4).  It runs with interrupts off, which may
 * wake it, and has an instance of Unicorn of its own.  Its instructions take the
 * cycles of a Cortex-M0+ (ARM DDI 0484C, table 3-1).
 */
#include <string.h>

#include "unicorn_canwire.h"
#include "unicorn_pio.h"
#include "unicorn_rp2040_core1.h"

#define PIO_BASE 0x50200000u
#define SIO_BASE 0xd0000000u
#define SCS_BASE 0xe000e000u
enum { FIFO_DEPTH = 8, SLICE = 160, N_START = 6, OPCODE_WFI = 0xbf30 };
enum { FIFO_ST = 20, FIFO_WR = 21, FIFO_RD = 22 };
enum { RESET_PIO0 = 10, RESET_PIO0_2350 = 11, FUNC_PIO0 = 6 };

struct mailbox { uint32_t words[FIFO_DEPTH], first, count; };

static struct pio pio;
static struct {
    uc_engine *uc;
    uint64_t cycle, limit;
    bool is_asleep, stop;
    uint32_t enabled, pending, start[N_START], n_start;
    uint32_t last_pc, last_size;
    bool branches;
    struct mailbox to_us, to_other;
} core1;
static uint64_t n_core1_instructions, n_core1_awake;

static void
pio_fault(const char *what)
{
    chip_fault("PIO: %s", what);
}

/*
 * PIO and the bus
 */

static bool
tx_level(void)
{
    uint32_t pin = wire_tx_pin();

    if (rp_function(pin) != FUNC_PIO0 || !(pio.oe >> pin & 1))
        return true;
    return pio.out >> pin & 1;
}

static void
run_pio(uint64_t until)
{
    while (pio.cycle < until) {
        uint32_t pads = UINT32_MAX;

        if (wire_exists() && !wire_step(tx_level()))
            pads &= ~(1u << wire_rx_pin());
        pio_step(&pio, pads);
    }
}

static void
skip_pio(uint64_t until)
{
    if (until <= pio.cycle)
        return;
    wire_skip(until - pio.cycle);
    pio.cycle = until;
}

static uint32_t
irq_lines(void)
{
    return (pio_irq(&pio) ? 1u << (rp.is_2350 ? 15 : 7) : 0)
        | (core1.to_us.count ? 1u << (rp.is_2350 ? 25 : 16) : 0);
}

static bool
is_quiet(void)
{
    return (!core1.uc || core1.is_asleep)
        && !((core1.pending | irq_lines()) & core1.enabled)
        && pio_is_idle(&pio) && (!wire_exists() || wire_is_quiet());
}

/*
 * Registers
 */

static uint64_t
pio_bus_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    (void)size;
    (void)param;
    if (rp_in_reset(rp.is_2350 ? RESET_PIO0_2350 : RESET_PIO0))
        chip_fault("PIO is held in reset");
    run_pio(uc == core1.uc ? core1.cycle : chip.cycle);
    return pio_read(&pio, (uint32_t)offset & 0xfff);
}

static void
pio_bus_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
              void *param)
{
    uint32_t alias = (uint32_t)offset >> 12 & 3, reg = (uint32_t)offset & 0xfff;

    (void)param;
    if (size != 4 || rp_in_reset(rp.is_2350 ? RESET_PIO0_2350 : RESET_PIO0))
        chip_fault("PIO is held in reset, or written in parts");
    run_pio(uc == core1.uc ? core1.cycle : chip.cycle);
    if (alias)
        value = rp_combine(pio_read(&pio, reg), (uint32_t)value, alias);
    pio_write(&pio, reg, (uint32_t)value);
    if (uc != core1.uc)
        chip_wake_at(chip.cycle);
}

static void
update_core0_irq(void)
{
    core_set_level(16 + (rp.is_2350 ? 25 : 15), core1.to_other.count != 0);
}

static uint32_t
mailbox_read(struct mailbox *mine, struct mailbox *other, uint32_t word)
{
    if (word == FIFO_ST)
        return (mine->count != 0) | (other->count < FIFO_DEPTH) << 1;
    if (word != FIFO_RD || !mine->count)
        return 0;
    mine->count--;
    return mine->words[mine->first++ % FIFO_DEPTH];
}

static void
mailbox_write(struct mailbox *to, uint32_t value)
{
    if (to->count == FIFO_DEPTH)
        chip_fault("a full queue between the cores is written");
    else
        to->words[(to->first + to->count++) % FIFO_DEPTH] = value;
}

static uint64_t
sio_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    uint32_t word = (uint32_t)offset / 4;

    (void)uc;
    (void)size;
    (void)param;
    if (word == 1) {
        run_pio(core1.cycle);
        return pio.sync[1];
    }
    if (word < FIFO_ST || word > FIFO_RD)
        chip_fault("the second core reads SIO at 0x%x", (uint32_t)offset);
    return mailbox_read(&core1.to_us, &core1.to_other, word);
}

static void
sio_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
          void *param)
{
    (void)uc;
    (void)size;
    (void)param;
    if (offset / 4 == FIFO_WR) {
        mailbox_write(&core1.to_other, (uint32_t)value);
        update_core0_irq();
    } else if (offset / 4 != FIFO_ST) {
        chip_fault("the second core writes SIO at 0x%x", (uint32_t)offset);
    }
}

static uint64_t
scs_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    (void)uc;
    (void)offset;
    (void)size;
    (void)param;
    return 0;
}

static void
scs_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
          void *param)
{
    (void)uc;
    (void)size;
    (void)param;
    if (offset == 0x100)
        core1.enabled |= (uint32_t)value;
    else if (offset == 0x280)
        core1.pending &= ~(uint32_t)value;
    else
        chip_fault("the second core writes 0x%x", (uint32_t)offset);
}

/*
 * Executing
 */

static uint32_t
count_bits(uint32_t mask)
{
    return (uint32_t)__builtin_popcount(mask);
}

/* Cycles, without those of a jump that is taken. */
static uint32_t
cost_of(uint16_t op, uint32_t size)
{
    if (size == 4)
        return (op & 0xf800) == 0xf000 ? 2 : 3;
    if ((op & 0xf600) == 0xb400)        /* push, pop */
        return 1 + count_bits(op & 0x1ff);
    if ((op & 0xf000) == 0xc000)        /* ldm, stm */
        return 1 + count_bits(op & 0xff);
    if (op >> 12 >= 5 && op >> 12 <= 9) /* load, store */
        return 2;
    return (op & 0xf800) == 0x4800 ? 2 : 1;
}

static void
on_instruction(uc_engine *uc, uint64_t addr, uint32_t size, void *param)
{
    uint32_t offset = (uint32_t)addr - chip.model->ram_base;
    uint16_t op;

    (void)param;
    if (core1.cycle >= core1.limit) {
        uc_emu_stop(uc);
        return;
    }
    if (core1.last_pc && (uint32_t)addr != core1.last_pc + core1.last_size)
        core1.cycle++;
    core1.last_pc = (uint32_t)addr;
    core1.last_size = size;
    n_core1_instructions++;
    if (offset >= chip.model->ram_size)
        return;
    memcpy(&op, chip.ram + offset, 2);
    core1.cycle += cost_of(op, size);
    if (op == OPCODE_WFI) {
        core1.is_asleep = true;
        uc_emu_stop(uc);
    }
}

static void
execute(uint64_t limit)
{
    uint32_t pc = 0;
    uint64_t begin = core1.cycle;
    uc_err error;

    core1.limit = limit;
    uc_reg_read(core1.uc, UC_ARM_REG_PC, &pc);
    error = uc_emu_start(core1.uc, pc | 1, 0xffffffff, 0, 0);
    n_core1_awake += core1.cycle - begin;
    if (error && !core1.is_asleep)
        chip_fault("the second core: %s", uc_strerror(error));
}

static void
wake_up(void)
{
    uint32_t pc = 0;

    uc_reg_read(core1.uc, UC_ARM_REG_PC, &pc);
    core1.is_asleep = false;
    core1.last_pc = 0;
    pc = (pc + 2) | 1;
    uc_reg_write(core1.uc, UC_ARM_REG_PC, &pc);
}

static void
launch(void)
{
    uc_hook hook;
    uint32_t sp = core1.start[4], pc = core1.start[5];

    if (uc_open(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS, &core1.uc)
        || uc_ctl_set_cpu_model(core1.uc, chip.model->cpu)
        || uc_mem_map_ptr(core1.uc, chip.model->ram_base, chip.model->ram_size,
                          UC_PROT_ALL, chip.ram)
        || uc_hook_add(core1.uc, &hook, UC_HOOK_CODE, on_instruction, NULL, 1, 0)
        || uc_mmio_map(core1.uc, PIO_BASE, 0x4000, pio_bus_read, NULL,
                       pio_bus_write, NULL)
        || uc_mmio_map(core1.uc, SIO_BASE, 0x1000, sio_read, NULL, sio_write,
                       NULL)
        || uc_mmio_map(core1.uc, SCS_BASE, 0x1000, scs_read, NULL, scs_write,
                       NULL)) {
        chip_fault("no second core");
        return;
    }
    if (!(pc & 1) || sp % 8)
        chip_fault("the second core is started at 0x%x, stack 0x%x", pc, sp);
    uc_reg_write(core1.uc, UC_ARM_REG_SP, &sp);
    uc_reg_write(core1.uc, UC_ARM_REG_PC, &pc);
    core1.cycle = chip.cycle;
    core1.is_asleep = false;
}

/* The boot ROM echoes what is right, and begins anew with what is not. */
static void
take_start_word(uint32_t value)
{
    static const uint32_t first[3] = { 0, 0, 1 };

    mailbox_write(&core1.to_other, value);
    if (core1.n_start < 3 && value != first[core1.n_start]) {
        core1.n_start = 0;
        return;
    }
    core1.start[core1.n_start++] = value;
    if (core1.n_start == N_START)
        launch();
}

static void
run_core1(uint64_t until)
{
    while (!chip.is_broken && core1.uc) {
        if (!core1.is_asleep) {
            if (core1.cycle >= until)
                break;
            execute(until);
            continue;
        }
        core1.pending |= irq_lines();
        if (core1.pending & core1.enabled) {
            if (core1.cycle < pio.cycle)
                core1.cycle = pio.cycle;
            wake_up();
            continue;
        }
        if (pio.cycle >= until) {
            core1.cycle = until;
            break;
        }
        run_pio((pio.cycle < core1.cycle ? core1.cycle : pio.cycle) + 1);
    }
    run_pio(until);
}

void
core1_run_events(void)
{
    if (pio.cycle > chip.cycle)
        return;
    if (is_quiet()) {
        skip_pio(chip.cycle);
        core1.cycle = chip.cycle;
        return;
    }
    run_core1(chip.cycle);
    update_core0_irq();
}

uint64_t
core1_next_event(void)
{
    return is_quiet() ? NEVER : chip.cycle + SLICE;
}

/*
 * The first core
 */

uint32_t
core1_fifo_read(uint32_t word)
{
    uint32_t value;

    core1_run_events();
    value = mailbox_read(&core1.to_other, &core1.to_us, word);
    update_core0_irq();
    return value;
}

void
core1_fifo_write(uint32_t word, uint32_t value)
{
    core1_run_events();
    if (word == FIFO_WR && !core1.uc)
        take_start_word(value);
    else if (word == FIFO_WR)
        mailbox_write(&core1.to_us, value);
    update_core0_irq();
    chip_wake_at(chip.cycle);
}

void
core1_map(uc_engine *uc)
{
    if (uc_mmio_map(uc, PIO_BASE, 0x4000, pio_bus_read, NULL, pio_bus_write,
                    NULL))
        chip_fault("no PIO");
}

void
core1_reset(void)
{
    if (core1.uc)
        uc_close(core1.uc);
    memset(&core1, 0, sizeof(core1));
    pio_reset(&pio, rp.is_2350, pio_fault);
    pio.cycle = chip.cycle;
    core1.cycle = chip.cycle;
}

/* For tests: most cycles from a sample to its word; cycles that waited for words;
 * samples that were lost; instructions and cycles of the second core; cycles. */
void
unicorn_core1_read(uint64_t *stats)
{
    stats[0] = pio.most_cycles;
    stats[1] = pio.n_waits;
    stats[2] = pio.n_overruns;
    stats[3] = n_core1_instructions;
    stats[4] = n_core1_awake;
    stats[5] = chip.cycle;
    pio.most_cycles = 0;
}
