/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * An AVR chip, emulated cycle by cycle, as a micro-controller of the virtual
 * world.
 *
 * Wraps libsimavr behind vmcu_abi.h.  The chip and its program are named by
 * the environment when power comes on: SIMAVR_ELF, SIMAVR_MCU and SIMAVR_HZ.
 * Facts about libsimavr 1.6 are made good here: it takes no interrupt inside
 * `sei; nop; cli`, charges no cycles for entering one, takes no voltage for the
 * channels 8 to 15, receives bytes of 11 bits and
 * up to 64 that are not read in time, overlooks a compare value just
 * behind an overflow, clears all flags of TIFR1 when any is written to, and
 * forgets one that is raised while its interrupt is not enabled.
 */
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_interrupts.h>
#include <simavr/sim_core_decl.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_timer.h>
#include <simavr/avr_uart.h>
#include <simavr/avr_watchdog.h>

#include "simavr_meter.h"
#include "vmcu_abi.h"

enum {
    N_PORTS = 12,               /* 'A' .. 'L' */
    N_PINS = N_PORTS * 8,
    RX_SIZE = 4096,
    SLICE_CYCLES = 1600,        /* a running cpu always has a next event */
    BITS_A_BYTE = 10,
    RX_DEPTH = 3,               /* two bytes and one that is being shifted in */
    START_CYCLES = 100,         /* between the writes that start the timer */
    MAX_BOOT_CYCLES = 1000000,
    MEMORY_START = 0x200,       /* no chip has registers from here on */
    FILLING = 0xa5,
    RAMPZ_ADDRESS = 0x5b,
    N_ADC_VALUES = 8,           /* that libsimavr has room for */
};

/* simavr_bus.c, where that is linked: its buses lead into the world too. */
__attribute__((weak)) void simavr_bus_connect(
    avr_t *avr, const struct vmcu_host *host, uint64_t (*clock)(void));
/* simavr_usb.c, likewise: the console is there if the chip has USB. */
__attribute__((weak)) int simavr_usb_connect(
    avr_t *avr, const struct vmcu_host *host, uint64_t (*clock)(void));
__attribute__((weak)) void simavr_usb_run(void);
__attribute__((weak)) int simavr_usb_rx(const uint8_t *buf, uint32_t len);

struct chip {
    avr_t *avr;
    struct vmcu_host host;
    uint64_t base;              /* clock at cycle 0 */
    uint32_t byte_cycles, entry_cycles;
    uint8_t level[N_PINS];
    uint32_t rx_head, rx_tail;
    uint8_t rx[RX_SIZE];
    avr_adc_t *adc;
    avr_uart_t *uart;
    uint32_t n_waiting;         /* bytes that the chip has received */
    uint8_t waiting[RX_DEPTH];
    avr_timer_t *timer;         /* timer 1 */
    uint64_t turn;              /* cycle at which it last was 0 */
    int has_usb;
};

static struct chip chip;

static uint64_t
now(void)
{
    return chip.base + chip.avr->cycle;
}

static uint32_t
env_number(const char *name, uint32_t fallback)
{
    const char *text = getenv(name);

    return text ? (uint32_t)strtoul(text, NULL, 10) : fallback;
}

/*
 * What the chip does to its surroundings
 */

static void
on_uart_out(avr_irq_t *irq, uint32_t value, void *param)
{
    uint8_t byte = (uint8_t)value;

    (void)irq;
    (void)param;
    chip.host.tx(chip.host.ctx, now(), &byte, 1);
}

static void
on_pin(avr_irq_t *irq, uint32_t value, void *param)
{
    uint32_t pin = (uint32_t)(uintptr_t)param;
    uint8_t level = value & 1;

    (void)irq;
    if (chip.level[pin] == level)
        return;
    chip.level[pin] = level;
    chip.host.pin_out(chip.host.ctx, now(), pin, level);
}

/* SIMAVR_ADC_PINS lists the pins of the channels, as "PF0 PF1 ...". */
static uint32_t
find_adc_pin(uint32_t channel)
{
    const char *pins = getenv("SIMAVR_ADC_PINS");

    if (!pins || strlen(pins) < channel * 4 + 3)
        return 0;
    pins += channel * 4;
    return (uint32_t)(pins[1] - 'A') * 8 + (uint32_t)(pins[2] - '0');
}

static void
on_adc_start(avr_irq_t *irq, uint32_t value, void *param)
{
    union {
        avr_adc_mux_t mux;
        uint32_t v;
    } e = { .v = value };
    uint32_t pin = find_adc_pin(e.mux.src + e.mux.diff * N_ADC_VALUES);
    uint32_t fraction;

    (void)irq;
    (void)param;
    fraction = chip.host.adc_in(chip.host.ctx, now(), pin);
    chip.adc->adc_values[e.mux.src] = (uint16_t)((fraction * 5000u + 32768u) >> 16);
}

static void
on_interrupt(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    (void)param;
    /* Also called on the way back to an interrupt that was interrupted. */
    if (!value || chip.avr->pc != value * chip.avr->vector_size)
        return;
    simavr_meter_enter();
    chip.avr->cycle += chip.entry_cycles;
}

/* Time passes in cycles here, never on the host. */
static void
no_sleep(avr_t *avr, avr_cycle_count_t cycles)
{
    (void)avr;
    simavr_meter_sleep(cycles + 1);
}

/*
 * What the surroundings do to the chip
 */

/* A byte has come.  What finds no room in the chip is lost. */
static avr_cycle_count_t
on_byte(avr_t *avr, avr_cycle_count_t when, void *param)
{
    uint8_t data = chip.rx[chip.rx_tail++ % RX_SIZE];

    (void)param;
    chip.uart->cycles_per_byte = chip.byte_cycles;
    if (chip.n_waiting < RX_DEPTH && avr_regbit_get(avr, chip.uart->rxen)) {
        chip.waiting[chip.n_waiting++] = data;
        avr_raise_interrupt(avr, &chip.uart->rxc);
    }
    return chip.rx_head == chip.rx_tail ? 0 : when + chip.byte_cycles;
}

/* A byte that is read is no longer flagged, the next one is. */
static uint8_t
read_uart(avr_t *avr, avr_io_addr_t addr, void *param)
{
    avr_int_vector_t *flag = &chip.uart->rxc;

    (void)param;
    if (!chip.n_waiting)
        return avr->data[addr];
    avr->data[addr] = chip.waiting[0];
    memmove(chip.waiting, chip.waiting + 1, --chip.n_waiting);
    avr_clear_interrupt(avr, flag);
    avr_regbit_clear(avr, flag->raised);
    if (chip.n_waiting)
        avr_raise_interrupt(avr, flag);
    return avr->data[addr];
}

/* The program reads a port: what drives its inputs is looked at now. */
static uint8_t
read_port(avr_t *avr, avr_io_addr_t addr, void *param)
{
    const avr_ioport_t *port = param;
    uint8_t ddr = avr->data[port->r_ddr], out = avr->data[port->r_port];
    uint8_t value = out & ddr;
    uint32_t bit;

    for (bit = 0; bit < 8; bit++)
        if (!(ddr & (1u << bit))
            && chip.host.pin_in(chip.host.ctx, now(),
                                (uint32_t)(port->name - 'A') * 8 + bit,
                                out & (1u << bit) ? 1 : 0))
            value |= (uint8_t)(1u << bit);
    avr->data[addr] = value;
    return value;
}

/*
 * The contract
 */

/* The first peripheral of a kind, which begins with its avr_io_t. */
static void *
find_io(const avr_t *avr, const char *kind)
{
    avr_io_t *io = avr->io_port;

    while (io && strcmp(io->kind, kind))
        io = io->next;
    return io;
}

/* The one of several that is called `name`: its second member. */
#define FIND_NAMED(TYPE, FOUND, KIND, NAME) do { \
    avr_io_t *io_; \
    for (io_ = chip.avr->io_port; io_; io_ = io_->next) \
        if (!strcmp(io_->kind, (KIND)) && ((TYPE *)io_)->name == (NAME)) \
            (FOUND) = (TYPE *)io_; \
} while (0)

static void
connect_port(avr_t *avr, avr_ioport_t *port)
{
    uint32_t bit;

    avr->io[AVR_DATA_TO_IO(port->r_pin)].r.c = read_port;
    avr->io[AVR_DATA_TO_IO(port->r_pin)].r.param = port;
    for (bit = 0; bit < 8; bit++) {
        uint32_t pin = (uint32_t)(port->name - 'A') * 8 + bit;

        avr_irq_register_notify(port->io.irq + IOPORT_IRQ_PIN0 + bit, on_pin,
                                (void *)(uintptr_t)pin);
    }
}

static void
connect_pins(avr_t *avr)
{
    avr_io_t *io;

    for (io = avr->io_port; io; io = io->next)
        if (!strcmp(io->kind, "port"))
            connect_port(avr, (avr_ioport_t *)io);
}

/* Channels beyond 7 share the values of the others, and are told from them by
 * `diff`, which has no use in a single conversion. */
static void
connect_adc(avr_t *avr)
{
    uint32_t i;

    chip.adc = find_io(avr, "adc");
    for (i = 0; i < 64; i++) {
        avr_adc_mux_t *mux = &chip.adc->muxmode[i];

        if (mux->kind == ADC_MUX_SINGLE && mux->src >= N_ADC_VALUES) {
            mux->src -= N_ADC_VALUES;
            mux->diff = 1;
        }
    }
    avr_irq_register_notify(
        avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER),
        on_adc_start, NULL);
}

static void
connect_uart(avr_t *avr)
{
    uint32_t flags = 0;
    char name = (char)('0' + env_number("SIMAVR_UART", 0));

    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS(name), &flags);
    FIND_NAMED(avr_uart_t, chip.uart, "uart", name);
    if (!chip.uart)
        return;
    avr->io[AVR_DATA_TO_IO(chip.uart->r_udr)].r.c = read_uart;
    avr_irq_register_notify(
        avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(name), UART_IRQ_OUTPUT),
        on_uart_out, NULL);
}

static avr_int_vector_t *
get_flag(uint32_t number)
{
    return number < AVR_TIMER_COMP_COUNT ? &chip.timer->comp[number].interrupt
        : &chip.timer->overflow;
}

/* Flags of timer 1: those that are written as 1 are cleared. */
static void
write_flags(avr_t *avr, avr_io_addr_t addr, uint8_t value, void *param)
{
    uint32_t i;

    (void)param;
    for (i = 0; i <= AVR_TIMER_COMP_COUNT; i++) {
        avr_int_vector_t *flag = get_flag(i);

        if (flag->raised.reg == addr && value & (1u << flag->raised.bit))
            avr_clear_interrupt(avr, flag);
    }
}

/* Interrupts of timer 1: one that is enabled while its flag is set, comes. */
static void
write_mask(avr_t *avr, avr_io_addr_t addr, uint8_t value, void *param)
{
    uint32_t i;

    (void)param;
    avr->data[addr] = value;
    for (i = 0; i <= AVR_TIMER_COMP_COUNT; i++) {
        avr_int_vector_t *flag = get_flag(i);

        if (flag->enable.reg == addr && value & (1u << flag->enable.bit)
            && avr_regbit_get(avr, flag->raised) && !flag->pending)
            avr_raise_interrupt(avr, flag);
    }
}

static void
connect_timer(avr_t *avr)
{
    avr_io_addr_t flags, mask;

    FIND_NAMED(avr_timer_t, chip.timer, "timer", '1');
    flags = chip.timer->overflow.raised.reg;
    mask = chip.timer->overflow.enable.reg;
    avr->io[AVR_DATA_TO_IO(flags)].w.c = write_flags;
    avr->io[AVR_DATA_TO_IO(mask)].w.c = write_mask;
}

/* Power came on so long ago that the program's clock agrees with the world's:
 * run until it has started its timer. */
static int32_t
start_clock(uint64_t clock)
{
    uint64_t started = 0;

    while (!started || chip.avr->cycle - started < START_CYCLES) {
        if (chip.avr->cycle > MAX_BOOT_CYCLES)
            return -3;
        chip.avr->run_cycle_limit = 1;
        avr_run(chip.avr);
        started = chip.timer->tov_base;
    }
    chip.base = clock - started;
    return 0;
}

/* A chip that libsimavr does not know, made of one that it does: its memories
 * are told by SIMAVR_FLASHEND, SIMAVR_RAMEND and SIMAVR_E2END. */
static avr_t *
make_chip(const char *mcu)
{
    const char *core = getenv("SIMAVR_CORE");
    avr_t *avr = avr_make_mcu_by_name(core ? core : mcu);

    if (!avr)
        return NULL;
    avr->flashend = env_number("SIMAVR_FLASHEND", avr->flashend);
    avr->ramend = (uint16_t)env_number("SIMAVR_RAMEND", avr->ramend);
    avr->e2end = env_number("SIMAVR_E2END", avr->e2end);
    if (avr->flashend > 0xffff)
        avr->rampz = RAMPZ_ADDRESS;
    return avr_init(avr) ? NULL : avr;
}

static int32_t
power_on(const struct vmcu_host *host, uint64_t clock)
{
    const char *path = getenv("SIMAVR_ELF"), *mcu = getenv("SIMAVR_MCU");
    elf_firmware_t firmware;
    avr_t *avr;

    memset(&chip, 0, sizeof(chip));
    memset(&firmware, 0, sizeof(firmware));
    if (!path || !mcu || elf_read_firmware(path, &firmware))
        return -1;
    avr = make_chip(mcu);
    if (!avr)
        return -2;
    snprintf(firmware.mmcu, sizeof(firmware.mmcu), "%s", mcu);
    firmware.frequency = env_number("SIMAVR_HZ", 16000000);
    avr_load_firmware(avr, &firmware);
    memset(avr->data + MEMORY_START, FILLING, avr->ramend + 1 - MEMORY_START);
    avr->sleep = no_sleep;
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr->log = LOG_ERROR;
    chip.avr = avr;
    simavr_meter_connect(avr);
    chip.host = *host;
    chip.byte_cycles = firmware.frequency * BITS_A_BYTE
        / env_number("SIMAVR_BAUD", 250000);
    chip.entry_cycles = avr->flashend > 0x1ffff ? 5 : 4;
    connect_timer(avr);
    connect_pins(avr);
    if (simavr_usb_connect)
        chip.has_usb = simavr_usb_connect(avr, host, now);
    if (!chip.has_usb)
        connect_uart(avr);
    connect_adc(avr);
    if (simavr_bus_connect)
        simavr_bus_connect(avr, host, now);
    avr_irq_register_notify(
        avr_get_interrupt_irq(avr, AVR_INT_ANY) + AVR_INT_IRQ_RUNNING,
        on_interrupt, NULL);
    return start_clock(clock);
}

static int32_t
rx(uint64_t clock, const uint8_t *buf, uint32_t len)
{
    uint32_t i;

    (void)clock;
    if (chip.has_usb)
        return simavr_usb_rx(buf, len);
    if (len > RX_SIZE - (chip.rx_head - chip.rx_tail))
        return 0;
    if (chip.rx_head == chip.rx_tail)
        avr_cycle_timer_register(chip.avr, chip.byte_cycles, on_byte, NULL);
    for (i = 0; i < len; i++)
        chip.rx[chip.rx_head++ % RX_SIZE] = buf[i];
    return 1;
}

/* A compare value that the counter reaches before its overflow is noticed, as
 * that happens between two instructions only. */
static void
raise_lost_compare(void)
{
    avr_timer_t *timer = chip.timer;
    uint32_t i;

    if (timer->tov_base == chip.turn)
        return;
    chip.turn = timer->tov_base;
    for (i = 0; i < AVR_TIMER_COMP_COUNT; i++)
        if (timer->comp[i].comp_cycles < chip.avr->cycle - chip.turn)
            avr_raise_interrupt(chip.avr, &timer->comp[i].interrupt);
}

/* Bytes at the end of the memory that were in use at most, of `kept`: those
 * that no longer are what they were filled with. */
uint32_t simavr_stack_used(uint32_t kept);
uint32_t
simavr_stack_used(uint32_t kept)
{
    const uint8_t *memory = chip.avr->data + chip.avr->ramend + 1 - kept;
    uint32_t i = 0;

    while (i < kept && memory[i] == FILLING)
        i++;
    return kept - i;
}

/* Cycles until something has to be looked at, at most. */
static uint64_t
limit_cycles(uint64_t until)
{
    uint64_t ahead = until - now();

    if (simavr_meter_is_watching())
        return 1;
    return ahead < 100 ? ahead : 100;
}

static uint64_t
run(uint64_t until)
{
    avr_t *avr = chip.avr;

    while (now() < until) {
        int8_t was;
        int state;

        if (chip.has_usb)
            simavr_usb_run();
        avr->run_cycle_limit = limit_cycles(until);
        was = avr->interrupt_state;
        state = avr_run(avr);
        if (simavr_meter_is_watching())
            simavr_meter_look();
        raise_lost_compare();
        if (was == -1 && avr->interrupt_state > 0)
            avr_service_interrupts(avr);
        if (state == cpu_Done || state == cpu_Crashed)
            return UINT64_MAX;
    }
    return now() + SLICE_CYCLES;
}

static int32_t
find_pin(const char *name)
{
    if (name[0] != 'P' || name[1] < 'A' || name[1] > 'L'
        || !isdigit((unsigned char)name[2]) || name[2] > '7' || name[3])
        return -1;
    return (name[1] - 'A') * 8 + name[2] - '0';
}

static void
power_off(void)
{
    if (chip.avr)
        avr_terminate(chip.avr);
    chip.avr = NULL;
}

const struct vmcu_ops *
vmcu_get_ops(void)
{
    static struct vmcu_ops ops = {
        .abi_version = VMCU_ABI_VERSION, .n_pins = N_PINS, .name = "simavr",
        .power_on = power_on, .rx = rx, .run = run, .find_pin = find_pin,
        .power_off = power_off,
    };

    ops.clock_freq = env_number("SIMAVR_HZ", 16000000);
    return &ops;
}
