/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Memories and blocks around two PRUs.  Loads cost what TI measured (SPRACE8),
 * for other addresses than these what the slowest of them costs.
 */
#include <stdio.h>
#include <string.h>

#include "pru_soc.h"

enum { SHARED = 0x10000, INTC = 0x20000, CONTROL = 0x22000, CFG = 0x26000,
       IEP = 0x2e000, IEP_END = 0x2e100, MASTER = 0x80000,
       CM = 0x44e00000, ADC = 0x44e0d000,
       WAIT_LOCAL = 2, WAIT_CONTROL = 3, WAIT_IEP = 11, WAIT_CHIP = 32,
       WAIT_DDR = 44, ADC_CYCLES = 15, ADC_SOURCE_HZ = 24000000 };

static const uint32_t bank_base[N_BANKS] = {
    0x44e07000, 0x4804c000, 0x481ac000, 0x481ae000 };
/* Their clocks' registers, relative to CM */
static const uint32_t bank_clock[N_BANKS] = { 0x408, 0xac, 0xb0, 0xb4 };
enum { ADC_CLOCK = 0x4bc, MODULE_ON = 2 };

struct soc soc;

void
soc_fault(const struct pru_core *core, const char *what, uint32_t detail)
{
    if (soc.is_broken)
        return;
    soc.is_broken = true;
    fprintf(stderr, "pru%u at 0x%x, cycle %llu: %s (0x%x)\n", core->index,
            core->pc * 4, (unsigned long long)core->cycle, what, detail);
}

static void
on_fault(struct pru_core *core, const char *what, uint32_t detail)
{
    soc_fault(core, what, detail);
    core->is_running = false;
}

uint64_t
soc_clock(uint64_t cycle)
{
    return soc.base + cycle;
}

uint8_t *
soc_ddr(uint32_t addr, uint32_t len)
{
    uint32_t offset = addr - DDR_BASE;

    return offset < DDR_SIZE && len <= DDR_SIZE - offset ? soc.ddr + offset
        : NULL;
}

/*
 * Counter (IEP)
 */

enum { IEP_CONFIG = 0x00, IEP_COUNT = 0x0c, IEP_COMPARE_CONFIG = 0x40 };

static uint32_t
iep_read(const struct pru_core *core, uint32_t reg)
{
    switch (reg) {
    case IEP_CONFIG:
        return soc.is_counting | soc.counter_step << 4;
    case IEP_COUNT:
        return soc.is_counting ? (uint32_t)((core->cycle - soc.counter_zero)
                                            * soc.counter_step) : 0;
    default:
        return 0;
    }
}

static void
iep_write(struct pru_core *core, uint32_t reg, uint32_t value)
{
    if (reg == IEP_COUNT && value) {
        on_fault(core, "the counter is set to something", value);
    } else if (reg == IEP_COUNT) {
        soc.counter_zero = core->cycle;
    } else if (reg == IEP_CONFIG) {
        if ((value & 1) && !soc.is_counting)
            soc.counter_zero = core->cycle;
        soc.is_counting = value & 1;
        soc.counter_step = value >> 4 & 0xf;
    }
}

/*
 * Events (INTC)
 */

enum { INTC_GLOBAL = 0x10, INTC_RAISE = 0x20, INTC_CLEAR = 0x24,
       INTC_ENABLE = 0x28, INTC_HOST_ENABLE = 0x34, INTC_RAW = 0x200 };

static bool
is_host_raised(uint32_t host)
{
    uint64_t left = soc.events_raised & soc.events_enabled;

    if (!soc.are_events_on || !(soc.hosts_enabled >> host & 1))
        return false;
    while (left) {
        uint32_t event = (uint32_t)__builtin_ctzll(left);
        uint8_t channel = soc.channel_of[event];
        left &= left - 1;
        if (channel < 10 && soc.host_of[channel] == host)
            return true;
    }
    return false;
}

void
soc_raise(uint32_t event)
{
    soc.events_raised |= UINT64_C(1) << (event % N_EVENTS);
    if (event == EVENT_TO_ARM)
        soc.arm_kicked = true;
}

static void
intc_write(struct pru_core *core, uint32_t reg, uint32_t value)
{
    uint64_t bit = UINT64_C(1) << (value % N_EVENTS);

    switch (reg) {
    case INTC_GLOBAL: soc.are_events_on = value & 1; break;
    case INTC_RAISE: soc_raise(value); break;
    case INTC_CLEAR: soc.events_raised &= ~bit; break;
    case INTC_ENABLE: soc.events_enabled |= bit; break;
    case INTC_HOST_ENABLE: soc.hosts_enabled |= 1u << (value & 15); break;
    default: on_fault(core, "no such register of the INTC", reg); break;
    }
}

static uint32_t
read_r31(struct pru_core *core)
{
    (void)core;
    return (uint32_t)is_host_raised(0) << 30
        | (uint32_t)is_host_raised(1) << 31;
}

static void
write_r31(struct pru_core *core, uint32_t value)
{
    (void)core;
    if (value & 0x20)
        soc_raise(16 + (value & 15));
}

/*
 * Pins
 */

enum { GPIO_OE = 0x134, GPIO_IN = 0x138, GPIO_OUT = 0x13c, GPIO_CLEAR = 0x190,
       GPIO_SET = 0x194 };

static void
tell_pins(const struct pru_core *core, uint32_t bank)
{
    struct gpio_bank *b = &soc.banks[bank];
    uint32_t now = b->out & ~b->is_input, changed = now ^ b->driven;

    b->driven = now;
    for (; changed; changed &= changed - 1) {
        uint32_t pin = (uint32_t)__builtin_ctz(changed);
        if (soc.host.pin_out)
            soc.host.pin_out(soc.host.ctx, soc_clock(core->cycle),
                             bank * 32 + pin, now >> pin & 1);
    }
}

static uint32_t
gpio_read(const struct pru_core *core, uint32_t bank, uint32_t reg)
{
    const struct gpio_bank *b = &soc.banks[bank];
    uint32_t pin, value = b->out & ~b->is_input;

    if (reg == GPIO_OE)
        return b->is_input;
    if (reg == GPIO_OUT)
        return b->out;
    if (reg != GPIO_IN)
        return 0;
    for (pin = 0; pin < 32; pin++)
        if (b->is_input >> pin & 1)
            value |= (uint32_t)(soc.host.pin_in(
                soc.host.ctx, soc_clock(core->cycle), bank * 32 + pin, 0) != 0)
                << pin;
    return value;
}

static void
gpio_write(const struct pru_core *core, uint32_t bank, uint32_t reg,
           uint32_t value)
{
    struct gpio_bank *b = &soc.banks[bank];

    if (reg == GPIO_OE)
        b->is_input = value;
    else if (reg == GPIO_OUT)
        b->out = value;
    else if (reg == GPIO_SET)
        b->out |= value;
    else if (reg == GPIO_CLEAR)
        b->out &= ~value;
    tell_pins(core, bank);
}

/*
 * Analog inputs (TSC_ADC): steps that are enabled run once, one after the other
 */

enum { ADC_CONTROL = 0x40, ADC_STATUS = 0x44, ADC_DIVIDER = 0x4c,
       ADC_ENABLE = 0x54, ADC_STEPS = 0x64, ADC_STEPS_END = 0xe4,
       ADC_COUNT = 0xe4, ADC_DATA = 0x100, ADC_UNLOCK = 4 };

static uint64_t
adc_step_cycles(void)
{
    return (uint64_t)(soc.adc_divider + 1) * ADC_CYCLES
        * (PRU_HZ / ADC_SOURCE_HZ + 1);
}

static void
adc_run(uint64_t cycle)
{
    while (soc.adc_enabled && cycle >= soc.adc_done) {
        uint32_t step = (uint32_t)__builtin_ctz(soc.adc_enabled) - 1;
        uint32_t input = soc.adc_steps[step] >> 19 & 15;
        uint32_t value = soc.host.adc_in(soc.host.ctx, soc_clock(cycle),
                                         N_PINS + input % N_ANALOG) >> 4;
        if (soc.adc_count < 8)
            soc.adc_fifo[soc.adc_count++] = value | step << 16;
        soc.adc_enabled &= soc.adc_enabled - 1;
        soc.adc_done += adc_step_cycles();
    }
}

static uint32_t
adc_read(const struct pru_core *core, uint32_t reg)
{
    uint32_t value;

    adc_run(core->cycle);
    if (reg == ADC_COUNT)
        return soc.adc_count;
    if (reg == ADC_CONTROL)
        return soc.adc_control;
    if (reg == ADC_STATUS)
        return soc.adc_enabled ? 0x20 : 0x10;
    if (reg != ADC_DATA || !soc.adc_count)
        return 0;
    value = soc.adc_fifo[0];
    memmove(soc.adc_fifo, soc.adc_fifo + 1, sizeof(soc.adc_fifo) - 4);
    soc.adc_count--;
    return value;
}

static void
adc_write(struct pru_core *core, uint32_t reg, uint32_t value)
{
    adc_run(core->cycle);
    if (reg == ADC_CONTROL) {
        soc.adc_control = value;
    } else if (reg == ADC_DIVIDER) {
        soc.adc_divider = value;
    } else if (reg >= ADC_STEPS && reg < ADC_STEPS_END) {
        if (!(soc.adc_control & ADC_UNLOCK))
            on_fault(core, "the steps of the ADC are locked", reg);
        if (!((reg - ADC_STEPS) & 4))
            soc.adc_steps[(reg - ADC_STEPS) / 8] = value;
    } else if (reg == ADC_ENABLE && (value & 0x1fffe)) {
        if (!(soc.adc_control & 1))
            on_fault(core, "the ADC is off", value);
        if (!soc.adc_enabled)
            soc.adc_done = core->cycle + adc_step_cycles();
        soc.adc_enabled |= value & 0x1fffe;
    }
}

/*
 * The chip's bus
 */

static uint32_t *
find_clock(uint32_t offset)
{
    uint32_t i;

    for (i = 0; i < N_BANKS; i++)
        if (offset == bank_clock[i])
            return &soc.banks[i].clock_control;
    return offset == ADC_CLOCK ? &soc.adc_clock_control : NULL;
}

/* Bank of pins at an address; N_BANKS: none. */
static uint32_t
find_bank(uint32_t addr)
{
    uint32_t i;

    for (i = 0; i < N_BANKS; i++)
        if (addr >= bank_base[i] && addr < bank_base[i] + 0x1000)
            break;
    return i;
}

static void
check_clock(struct pru_core *core, uint32_t control, uint32_t addr)
{
    if ((control & 3) != MODULE_ON)
        on_fault(core, "a block without a clock", addr);
}

static uint32_t
chip_read(struct pru_core *core, uint32_t addr)
{
    uint32_t bank = find_bank(addr);

    if (bank < N_BANKS) {
        check_clock(core, soc.banks[bank].clock_control, addr);
        return gpio_read(core, bank, addr - bank_base[bank]);
    }
    if (addr >= ADC && addr < ADC + 0x1000) {
        check_clock(core, soc.adc_clock_control, addr);
        return adc_read(core, addr - ADC);
    }
    if (addr >= CM && addr < CM + 0x1000 && find_clock(addr - CM))
        return *find_clock(addr - CM);
    on_fault(core, "nothing is there to be read", addr);
    return 0;
}

static void
chip_write(struct pru_core *core, uint32_t addr, uint32_t value)
{
    uint32_t bank = find_bank(addr);

    if (bank < N_BANKS) {
        check_clock(core, soc.banks[bank].clock_control, addr);
        gpio_write(core, bank, addr - bank_base[bank], value);
    } else if (addr >= ADC && addr < ADC + 0x1000) {
        check_clock(core, soc.adc_clock_control, addr);
        adc_write(core, addr - ADC, value);
    } else if (addr >= CM && addr < CM + 0x1000 && find_clock(addr - CM)) {
        *find_clock(addr - CM) = value;
    } else {
        on_fault(core, "nothing is there to be written", addr);
    }
}

/*
 * Loads and stores
 */

/* Plain memory at an address, or NULL. */
static uint8_t *
find_memory(const struct pru_core *core, uint32_t addr, uint32_t len)
{
    if (addr + len <= 2 * PRU_DATA_SIZE && addr < 2 * PRU_DATA_SIZE) {
        uint32_t half = addr / PRU_DATA_SIZE;
        if ((addr + len - 1) / PRU_DATA_SIZE != half)
            return NULL;
        return soc.data[core->index ^ half] + addr % PRU_DATA_SIZE;
    }
    if (addr >= SHARED && addr + len <= SHARED + PRU_SHARED_SIZE)
        return soc.shared + (addr - SHARED);
    return soc_ddr(addr, len);
}

static uint32_t
read_register(struct pru_core *core, uint32_t addr)
{
    if (addr >= IEP && addr < IEP_END)
        return iep_read(core, addr - IEP);
    if (addr == INTC + INTC_RAW || addr == INTC + INTC_RAW + 4)
        return (uint32_t)(soc.events_raised >> (addr & 4) * 8);
    if (addr == CFG + 4)
        return soc.has_master ? 0 : 0x10;
    if (addr >= MASTER)
        return chip_read(core, addr);
    on_fault(core, "nothing is there to be read", addr);
    return 0;
}

static void
write_register(struct pru_core *core, uint32_t addr, uint32_t value)
{
    if (addr >= IEP && addr < IEP_END)
        iep_write(core, addr - IEP, value);
    else if (addr >= INTC && addr < CONTROL)
        intc_write(core, addr - INTC, value);
    else if (addr == CFG + 4)
        soc.has_master = !(value & 0x10);
    else if (addr >= MASTER)
        chip_write(core, addr, value);
    else
        on_fault(core, "nothing is there to be written", addr);
}

static bool
may_access(struct pru_core *core, uint32_t addr, uint32_t len)
{
    if (addr < MASTER || soc.has_master)
        return true;
    on_fault(core, "the chip's bus is not enabled", addr + len);
    return false;
}

/* Cycles of a load beyond its first. */
static uint32_t
load_wait(uint32_t addr, uint32_t len)
{
    uint32_t more = (len + 3) / 4 - 1;

    if (addr >= DDR_BASE)
        return WAIT_DDR + more;
    if (addr >= MASTER)
        return WAIT_CHIP + more;
    if (addr >= IEP && addr < IEP_END)
        return WAIT_IEP + more;
    return (addr >= CONTROL && addr < CFG ? WAIT_CONTROL : WAIT_LOCAL) + more;
}

/* Registers are loaded when the core has waited for them. */
static uint32_t
bus_load(struct pru_core *core, uint32_t addr, uint8_t *data, uint32_t len)
{
    const uint8_t *memory = find_memory(core, addr, len);
    uint32_t i, word;

    if (!may_access(core, addr, len))
        return 0;
    if (memory) {
        memcpy(data, memory, len);
    } else if ((addr | len) & 3) {
        on_fault(core, "part of a register is loaded", addr);
    } else {
        for (i = 0; i < len; i += 4) {
            word = read_register(core, addr + i);
            memcpy(data + i, &word, 4);
        }
    }
    return load_wait(addr, len);
}

static uint32_t
bus_store(struct pru_core *core, uint32_t addr, const uint8_t *data,
          uint32_t len)
{
    uint8_t *memory = find_memory(core, addr, len);
    uint32_t i, word;

    if (!may_access(core, addr, len))
        return 0;
    if (memory) {
        memcpy(memory, data, len);
    } else if ((addr | len) & 3) {
        on_fault(core, "part of a register is stored", addr);
    } else {
        for (i = 0; i < len; i += 4) {
            memcpy(&word, data + i, 4);
            write_register(core, addr + i, word);
        }
    }
    return (len + 3) / 4;
}

const struct pru_bus soc_bus = {
    .load = bus_load, .store = bus_store, .read_r31 = read_r31,
    .write_r31 = write_r31, .fault = on_fault,
};

static void
reset_core(uint32_t index)
{
    struct pru_core *core = &soc.cores[index];

    pru_core_reset(core, &soc_bus, index);
    core->constants[0] = INTC;
    core->constants[4] = CFG;
    core->constants[24] = 0;
    core->constants[25] = PRU_DATA_SIZE;
    core->constants[26] = IEP;
    core->constants[28] = SHARED;
}

void
soc_reset(void)
{
    uint32_t i;

    memset(&soc, 0, sizeof(soc));
    memset(soc.data, 0xa5, sizeof(soc.data));
    memset(soc.shared, 0xa5, sizeof(soc.shared));
    memset(soc.channel_of, 0xff, sizeof(soc.channel_of));
    memset(soc.host_of, 0xff, sizeof(soc.host_of));
    soc.counter_step = 5;
    for (i = 0; i < N_BANKS; i++)
        soc.banks[i].is_input = UINT32_MAX;
    reset_core(0);
    reset_core(1);
}
