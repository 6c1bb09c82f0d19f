/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * An emulated Cortex-M chip as a micro-controller of the virtual world.
 *
 * Wraps libunicorn and our models of the chip behind vmcu_abi.h.  The
 * environment names, when power comes on: UNICORN_ELF, UNICORN_CHIP, UNICORN_HZ
 * (of the program's clock), UNICORN_HSE (of the crystal, 0 without one) and
 * UNICORN_BAUD.  Power came on so long ago that the program's clock agrees with
 * the world's when the world begins.
 */
#include <ctype.h>
#include <elf.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unicorn_chip.h"

enum { RX_SIZE = 4096, OPCODE_WFI = 0xbf30, OPCODE_YIELD = 0xbf10,
       MAX_BOOT_CYCLES = 20000000 };
struct chip chip;

static uint8_t rx_buf[RX_SIZE];
static uint32_t rx_head, rx_tail;

void
chip_fault(const char *format, ...)
{
    va_list args;

    if (chip.is_broken)
        return;
    chip.is_broken = true;
    fprintf(stderr, "%s at cycle %llu: ", chip.model->name,
            (unsigned long long)chip.cycle);
    va_start(args, format);
    vfprintf(stderr, format, args);
    va_end(args);
    fprintf(stderr, "\n");
    chip.stop_at = 0;
}

void
chip_wake_at(uint64_t cycle)
{
    if (cycle < chip.stop_at)
        chip.stop_at = cycle;
}

/*
 * Executing
 */

/* The opcode at an address in flash or RAM. */
static uint16_t
read_opcode(uint32_t addr)
{
    uint32_t in_flash = addr - chip.model->family->flash_base;
    uint32_t in_ram = addr - chip.model->ram_base;
    uint16_t opcode = 0;

    if (in_flash < chip.model->flash_size)
        memcpy(&opcode, chip.flash + in_flash, 2);
    else if (in_ram < chip.model->ram_size)
        memcpy(&opcode, chip.ram + in_ram, 2);
    return opcode;
}

/* Before each instruction. */
static void
on_instruction(uc_engine *uc, uint64_t addr, uint32_t size, void *param)
{
    uint16_t opcode;

    (void)param;
    if (chip.cycle >= chip.stop_at
        || (chip.check_irqs && core_has_irq())) {
        uc_emu_stop(uc);
        return;
    }
    if (chip.has_set_mask)
        core_read_mask();
    chip.cycle++;
    chip.n_instructions++;
    chip.n_irq_instructions += chip.in_handler;
    opcode = read_opcode((uint32_t)addr);
    core_note_mask(opcode);
    if (size != 2)
        return;
    if (opcode == OPCODE_WFI || opcode == OPCODE_YIELD) {
        chip.is_asleep = true;
        uc_emu_stop(uc);
    }
}

static uint32_t
read_pc(void)
{
    uint32_t pc = 0;

    uc_reg_read(chip.uc, UC_ARM_REG_PC, &pc);
    return pc;
}

/* An instruction that sleeps has done so. */
static void
wake_up(void)
{
    uint32_t pc = (read_pc() + 2) | 1;

    chip.is_asleep = false;
    if (chip.off_since != NEVER)
        chip.off_since = chip.cycle;
    uc_reg_write(chip.uc, UC_ARM_REG_PC, &pc);
}

static void
execute(void)
{
    uc_err error = uc_emu_start(chip.uc, read_pc() | 1, 0xffffffff, 0, 0);

    if (core_end_irq(read_pc()) || !error || chip.is_asleep)
        return;
    chip_fault("%s at 0x%08x", uc_strerror(error), read_pc());
}

static void
feed_line(void)
{
    const struct family *family = chip.model->family;

    if (rx_head == rx_tail || chip.cycle < family->rx_free_at())
        return;
    family->rx(rx_buf[rx_tail++ % RX_SIZE]);
    if (rx_head != rx_tail)
        chip_wake_at(family->rx_free_at());
}

static uint64_t
next_event(void)
{
    uint64_t next = core_next_event(), other = chip.model->family->next_event();

    if (other < next)
        next = other;
    other = chip.model->family->rx_free_at();
    if (rx_head != rx_tail && other < next)
        next = other;
    return next;
}

/* Run up to the cycle `until`, or until the program has started its clock. */
static void
run_cycles(uint64_t until, bool is_booting)
{
    while (chip.cycle < until && !chip.is_broken && !chip.wants_reset
           && !(is_booting && chip.is_counting)) {
        uint64_t next;

        core_run_events();
        chip.model->family->run_events();
        feed_line();
        next = next_event();
        if (next > until)
            next = until;
        if (chip.is_asleep) {
            if (!chip.n_pending) {
                if (chip.cycle < next)
                    chip.cycle = next;
                continue;
            }
            wake_up();
        }
        if (core_has_irq())
            core_take_irq();
        chip.stop_at = next;
        execute();
    }
}

/*
 * Power
 */

static uint32_t
env_number(const char *name, uint32_t fallback)
{
    const char *text = getenv(name);

    return text ? (uint32_t)strtoul(text, NULL, 10) : fallback;
}

/* Put one segment where it is loaded; outside of flash is an error. */
static int32_t
load_segment(FILE *file, const Elf32_Phdr *segment)
{
    uint32_t offset = segment->p_paddr - chip.model->family->flash_base;

    if (segment->p_type != PT_LOAD || !segment->p_filesz)
        return 0;
    if (offset > chip.model->flash_size
        || segment->p_filesz > chip.model->flash_size - offset
        || fseek(file, segment->p_offset, SEEK_SET)
        || fread(chip.flash + offset, segment->p_filesz, 1, file) != 1)
        return -1;
    return 0;
}

/* Load the program; *start is the lowest address, where its vectors are. */
static int32_t
load_elf(const char *path, uint32_t *start)
{
    FILE *file = path ? fopen(path, "rb") : NULL;
    Elf32_Ehdr head;
    Elf32_Phdr segment;
    int32_t result = 0, i;

    if (!file)
        return -1;
    *start = UINT32_MAX;
    if (fread(&head, sizeof(head), 1, file) != 1
        || memcmp(head.e_ident, ELFMAG, SELFMAG) || head.e_machine != EM_ARM)
        result = -1;
    for (i = 0; !result && i < head.e_phnum; i++) {
        if (fseek(file, head.e_phoff + i * head.e_phentsize, SEEK_SET)
            || fread(&segment, sizeof(segment), 1, file) != 1)
            result = -1;
        else if ((result = load_segment(file, &segment)) == 0
                 && segment.p_type == PT_LOAD && segment.p_filesz
                 && segment.p_paddr < *start)
            *start = segment.p_paddr;
    }
    fclose(file);
    return result;
}

void
chip_map_flash(void)
{
    if (uc_mem_map_ptr(chip.uc, chip.model->family->flash_base,
                       chip.model->flash_size, UC_PROT_READ | UC_PROT_EXEC,
                       chip.flash))
        chip_fault("no flash");
}

static int32_t
open_engine(void)
{
    uc_hook hook;

    if (uc_open(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS, &chip.uc)
        || uc_ctl_set_cpu_model(chip.uc, chip.model->cpu))
        return -2;
    chip.flash = aligned_alloc(4096, chip.model->flash_size);
    chip.ram = aligned_alloc(4096, chip.model->ram_size);
    memset(chip.flash, 0xff, chip.model->flash_size);
    memset(chip.ram, 0xa5, chip.model->ram_size);
    if (uc_mem_map_ptr(chip.uc, chip.model->ram_base, chip.model->ram_size,
                       UC_PROT_ALL, chip.ram)
        || uc_hook_add(chip.uc, &hook, UC_HOOK_CODE, on_instruction, NULL,
                       1, 0))
        return -2;
    core_map(chip.uc);
    if (!chip.model->family->maps_flash)
        chip_map_flash();
    chip.model->family->map(chip.uc);
    return 0;
}

/* As a bootloader does: the stack, then the program's first instruction. */
static void
jump_to(uint32_t start)
{
    uint32_t words[2];

    memcpy(words, chip.flash + (start - chip.model->family->flash_base),
           sizeof(words));
    uc_reg_write(chip.uc, UC_ARM_REG_SP, &words[0]);
    uc_reg_write(chip.uc, UC_ARM_REG_PC, &words[1]);
}

static int32_t
power_on(const struct vmcu_host *host, uint64_t clock)
{
    uint32_t start;
    double ticks_hz, nominal;

    memset(&chip, 0, sizeof(chip));
    chip.tick_mul = chip.tick_div = 1;
    rx_head = rx_tail = 0;
    chip.model = unicorn_find_model(getenv("UNICORN_CHIP"));
    if (!chip.model || open_engine())
        return -2;
    if (load_elf(getenv("UNICORN_ELF"), &start))
        return -1;
    chip.start = start;
    chip.host = *host;
    chip.hse_hz = env_number("UNICORN_HSE", 8000000);
    chip.baud = env_number("UNICORN_BAUD", 250000);
    core_reset();
    chip.model->family->reset();
    if (chip.model->family->boot)
        chip.model->family->boot(start);
    else
        jump_to(start);
    run_cycles(MAX_BOOT_CYCLES, true);
    if (!chip.is_counting || chip.is_broken)
        return -3;
    ticks_hz = (double)chip.core_hz * chip.tick_mul / chip.tick_div;
    nominal = env_number("UNICORN_HZ", chip.model->max_hz);
    /* within what crystals are off, too */
    if (ticks_hz > 1.0001 * nominal || ticks_hz < .9999 * nominal) {
        chip_fault("core at %u Hz", chip.core_hz);
        return -4;
    }
    chip.base = clock - chip.cyccnt_zero * chip.tick_mul / chip.tick_div;
    return 0;
}

static int32_t
rx(uint64_t clock, const uint8_t *buf, uint32_t len)
{
    uint32_t i;

    (void)clock;
    if (len > RX_SIZE - (rx_head - rx_tail))
        return false;
    for (i = 0; i < len; i++)
        rx_buf[rx_head++ % RX_SIZE] = buf[i];
    return true;
}

static uint64_t
run(uint64_t until)
{
    uint64_t next;

    run_cycles(((until - chip.base) * chip.tick_div + chip.tick_mul - 1)
               / chip.tick_mul, false);
    if (chip.is_broken)
        return UINT64_MAX;
    if (chip.wants_reset) {
        chip.is_broken = true;
        chip.host.reset(chip.host.ctx, chip_now());
        return UINT64_MAX;
    }
    next = chip.is_asleep && !chip.n_pending ? next_event() : chip.cycle + 1600;
    if (next == NEVER)
        return NEVER;
    next = chip.base + next * chip.tick_mul / chip.tick_div;
    return next > until ? next : until + 1;
}

int32_t
chip_find_pin(const char *name, uint32_t per_port)
{
    char *end;
    uint32_t number;

    if (name[0] != 'P' || name[1] < 'A' || name[1] > 'K'
        || !isdigit((unsigned char)name[2]))
        return -1;
    number = (uint32_t)strtol(name + 2, &end, 10);
    if (*end || number >= per_port)
        return -1;
    return (int32_t)((uint32_t)(name[1] - 'A') * per_port + number);
}

static int32_t
find_pin(const char *name)
{
    return chip.model->family->find_pin(name);
}

static void
power_off(void)
{
    if (chip.uc)
        uc_close(chip.uc);
    free(chip.flash);
    free(chip.ram);
    memset(&chip, 0, sizeof(chip));
}

/* For tests: instructions, timer interrupts, instructions in those. */
void
unicorn_read_stats(uint64_t *stats)
{
    stats[0] = chip.n_instructions;
    stats[1] = chip.n_timer_irqs;
    stats[2] = chip.n_irq_instructions;
}

/* For tests: what struct delays tells, from now on if it is cleared. */
void
unicorn_read_delays(struct delays *delays, int32_t clears)
{
    *delays = chip.delays;
    if (clears)
        memset(&chip.delays, 0, sizeof(chip.delays));
}

/* For tests: has the program asked for the boot loader? */
int32_t
unicorn_wants_bootloader(void)
{
    return chip.wants_bootloader;
}

/* For tests: the reset that the program has asked for.  Memory keeps its
 * contents; the next program begins, and runs for some cycles. */
void
unicorn_restart(uint32_t cycles)
{
    chip.is_broken = chip.wants_reset = chip.is_asleep = false;
    chip.console = NULL;
    chip.n_devices = chip.n_pending = 0;
    core_reset();
    chip.model->family->reset();
    jump_to(chip.start);
    run_cycles(chip.cycle + cycles, false);
}

const struct vmcu_ops *
vmcu_get_ops(void)
{
    static struct vmcu_ops ops = {
        .abi_version = VMCU_ABI_VERSION, .n_pins = N_PINS, .name = "unicorn",
        .power_on = power_on, .rx = rx, .run = run, .find_pin = find_pin,
        .power_off = power_off,
    };

    ops.clock_freq = env_number("UNICORN_HZ", 72000000);
    return &ops;
}
