/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * An AVR chip, emulated cycle by cycle, as a micro-controller of the virtual
 * world.
 *
 * Wraps libsimavr behind vmcu_abi.h.  The chip and its program are named by
 * the environment when power comes on: SIMAVR_ELF, SIMAVR_MCU and SIMAVR_HZ.
 * Two facts about libsimavr 1.6 are made good here: it takes no interrupt
 * inside `sei; nop; cli`, and it charges no cycles for entering one.
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
#include <simavr/avr_uart.h>
#include <simavr/avr_watchdog.h>

#include "vmcu_abi.h"

enum {
    N_PORTS = 12,               /* 'A' .. 'L' */
    N_PINS = N_PORTS * 8,
    RX_SIZE = 4096,
    INPUT_POLL_CYCLES = 400,    /* how often input levels are looked at */
    SLICE_CYCLES = 1600,        /* a running cpu always has a next event */
    BITS_A_BYTE = 10,
};

struct chip {
    avr_t *avr;
    struct vmcu_host host;
    uint64_t base;              /* clock at cycle 0 */
    uint32_t byte_cycles, entry_cycles;
    uint8_t level[N_PINS], is_driving_input;
    uint64_t next_rx, next_poll;
    uint32_t rx_head, rx_tail;
    uint8_t rx[RX_SIZE];
    avr_irq_t *uart_in, *adc;
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
    if (chip.is_driving_input || chip.level[pin] == level)
        return;
    chip.level[pin] = level;
    chip.host.pin_out(chip.host.ctx, now(), pin, level);
}

static void
on_adc_start(avr_irq_t *irq, uint32_t value, void *param)
{
    union {
        avr_adc_mux_t mux;
        uint32_t v;
    } e = { .v = value };
    uint32_t channel = e.mux.src;
    /* ADC0..7 are on port F (mega2560), A (644p): told by SIMAVR_ADC_PORT */
    uint32_t port = env_number("SIMAVR_ADC_PORT", 'F') - 'A';
    uint32_t pin = (channel < 8 ? port : 'K' - 'A') * 8 + (channel & 7);
    uint32_t fraction;

    (void)irq;
    (void)param;
    fraction = chip.host.adc_in(chip.host.ctx, now(), pin);
    avr_raise_irq(chip.adc + ADC_IRQ_ADC0 + channel,
                  (fraction * 5000u + 32768u) >> 16);
}

static void
on_interrupt(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    (void)param;
    if (value)
        chip.avr->cycle += chip.entry_cycles;
}

/* Time passes in cycles here, never on the host. */
static void
no_sleep(avr_t *avr, avr_cycle_count_t cycles)
{
    (void)avr;
    (void)cycles;
}

/*
 * What the surroundings do to the chip
 */

static void
feed_uart(void)
{
    if (chip.rx_head == chip.rx_tail || now() < chip.next_rx)
        return;
    avr_raise_irq(chip.uart_in, chip.rx[chip.rx_tail++ % RX_SIZE]);
    chip.next_rx = now() + chip.byte_cycles;
}

static void
poll_port(char name, uint32_t first_pin)
{
    avr_ioport_state_t state;
    uint32_t bit;

    if (avr_ioctl(chip.avr, AVR_IOCTL_IOPORT_GETSTATE(name), &state))
        return;
    for (bit = 0; bit < 8; bit++) {
        uint32_t pin = first_pin + bit;
        uint8_t level;

        if (state.ddr & (1u << bit))
            continue;
        level = chip.host.pin_in(chip.host.ctx, now(), pin,
                                 state.port & (1u << bit) ? 1 : 0);
        if (level == ((state.pin >> bit) & 1))
            continue;
        chip.is_driving_input = 1;
        avr_raise_irq(avr_io_getirq(chip.avr, AVR_IOCTL_IOPORT_GETIRQ(name),
                                    (int)bit), level);
        chip.is_driving_input = 0;
    }
}

static void
poll_inputs(void)
{
    uint32_t i;

    if (now() < chip.next_poll)
        return;
    chip.next_poll = now() + INPUT_POLL_CYCLES;
    for (i = 0; i < N_PORTS; i++)
        if (i != 'I' - 'A')
            poll_port((char)('A' + i), i * 8);
}

/*
 * The contract
 */

static void
connect_pins(avr_t *avr)
{
    uint32_t pin;

    for (pin = 0; pin < N_PINS; pin++) {
        char port = (char)('A' + pin / 8);
        avr_irq_t *irq = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port),
                                       (int)(pin % 8));

        if (irq)
            avr_irq_register_notify(irq, on_pin, (void *)(uintptr_t)pin);
    }
}

static void
connect_uart(avr_t *avr)
{
    uint32_t flags = 0;

    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    chip.uart_in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'),
                                 UART_IRQ_INPUT);
    avr_irq_register_notify(
        avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT),
        on_uart_out, NULL);
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
    avr = avr_make_mcu_by_name(mcu);
    if (!avr || avr_init(avr))
        return -2;
    snprintf(firmware.mmcu, sizeof(firmware.mmcu), "%s", mcu);
    firmware.frequency = env_number("SIMAVR_HZ", 16000000);
    avr_load_firmware(avr, &firmware);
    avr->sleep = no_sleep;
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr->log = LOG_ERROR;
    chip.avr = avr;
    chip.host = *host;
    chip.base = clock;
    chip.byte_cycles = firmware.frequency * BITS_A_BYTE
        / env_number("SIMAVR_BAUD", 250000);
    chip.entry_cycles = avr->flashend > 0x1ffff ? 5 : 4;
    connect_pins(avr);
    connect_uart(avr);
    chip.adc = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, 0);
    avr_irq_register_notify(chip.adc + ADC_IRQ_OUT_TRIGGER, on_adc_start, NULL);
    avr_irq_register_notify(
        avr_get_interrupt_irq(avr, AVR_INT_ANY) + AVR_INT_IRQ_RUNNING,
        on_interrupt, NULL);
    return 0;
}

static int32_t
rx(uint64_t clock, const uint8_t *buf, uint32_t len)
{
    uint32_t i;

    (void)clock;
    if (len > RX_SIZE - (chip.rx_head - chip.rx_tail))
        return -1;
    for (i = 0; i < len; i++)
        chip.rx[chip.rx_head++ % RX_SIZE] = buf[i];
    return 0;
}

static uint64_t
run(uint64_t until)
{
    avr_t *avr = chip.avr;

    while (now() < until) {
        int8_t was;
        int state;

        feed_uart();
        poll_inputs();
        avr->run_cycle_limit = until - now() < 100 ? until - now() : 100;
        was = avr->interrupt_state;
        state = avr_run(avr);
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
