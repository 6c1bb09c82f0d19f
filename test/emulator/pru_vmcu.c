/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Two PRUs of an AM335x as one micro-controller of the virtual world, which
 * talks to its host through a port of Linux.  The environment names PRU0_ELF and
 * PRU1_ELF when power comes on; PRU0_DELAY and PRU1_DELAY are cycles.  It came on so long ago that the program's
 * clock agrees with the world's when the world begins.
 */
#include <stdlib.h>
#include <string.h>

#include "pru_soc.h"

enum { BOOT_CYCLES = 2000000, IDLE_CYCLES = 2000,
       AHEAD = 10 };

static bool
is_alive(void)
{
    return !soc.is_broken && soc.cores[0].is_running
        && soc.cores[1].is_running;
}

/* One core, until it is ahead of the other, or something else happens. */
static void
run_core(struct pru_core *core, uint64_t until)
{
    bool was_counting = soc.is_counting;

    while (core->cycle <= until && core->is_running && !soc.arm_kicked
           && soc.is_counting == was_counting)
        pru_core_step(core);
}

/* Both run side by side: always the one that is behind. */
static void
run_cycles(uint64_t until, bool is_booting)
{
    struct pru_core *a = &soc.cores[0], *b = &soc.cores[1];

    while (is_alive() && (a->cycle < until || b->cycle < until)
           && !(is_booting && soc.is_counting)) {
        if (a->cycle <= b->cycle)
            run_core(a, b->cycle + AHEAD);
        else
            run_core(b, a->cycle + AHEAD);
        if (soc.arm_kicked)
            arm_run(a->cycle);
    }
}

/* Linux starts one core after the other. */
static void
delay_core(uint32_t core, const char *cycles)
{
    if (cycles)
        soc.cores[core].cycle = strtoull(cycles, NULL, 10);
}

static int32_t
power_on(const struct vmcu_host *host, uint64_t clock)
{
    int32_t result;

    soc_reset();
    soc.host = *host;
    result = arm_load(getenv("PRU0_ELF"), 0);
    if (!result)
        result = arm_load(getenv("PRU1_ELF"), 1);
    if (result)
        return result;
    arm_start();
    delay_core(0, getenv("PRU0_DELAY"));
    delay_core(1, getenv("PRU1_DELAY"));
    run_cycles(BOOT_CYCLES, true);
    if (!soc.is_counting || !is_alive())
        return -30;
    soc.base = clock - soc.counter_zero;
    return 0;
}

static int32_t
rx(uint64_t clock, const uint8_t *buf, uint32_t len)
{
    (void)clock;
    return arm_write(buf, len);
}

static uint64_t
run(uint64_t until)
{
    run_cycles(until - soc.base, false);
    return is_alive() ? until + IDLE_CYCLES : UINT64_MAX;
}

static int32_t
find_pin(const char *name)
{
    char *end;
    unsigned long bank, bit;

    if (!strncmp(name, "AIN", 3) && name[3] >= '0' && name[3] < '0' + N_ANALOG
        && !name[4])
        return N_PINS + name[3] - '0';
    if (strncmp(name, "gpio", 4))
        return -1;
    bank = strtoul(name + 4, &end, 10);
    if (*end != '_' || end == name + 4 || bank >= N_BANKS)
        return -1;
    name = end + 1;
    bit = strtoul(name, &end, 10);
    return *end || end == name || bit >= 32 ? -1 : (int32_t)(bank * 32 + bit);
}

static void
power_off(void)
{
    soc_reset();
}

/* For tests: instructions of each core. */
void
pru_read_stats(uint64_t *stats)
{
    stats[0] = soc.cores[0].n_instructions;
    stats[1] = soc.cores[1].n_instructions;
}

/* For tests: somebody else has reset the converter of the analog inputs. */
void
pru_stop_converter(void)
{
    soc.adc_enabled = 0;
    soc.adc_count = 0;
}

/* For tests: run a program by itself on core 0 until it halts, for at most so
 * many instructions.  Its memory, NULL if it did not end well. */
const uint8_t *
pru_run_program(const char *path, uint32_t n_max)
{
    struct pru_core *core = &soc.cores[0];

    soc_reset();
    if (arm_load(path, 0))
        return NULL;
    core->is_running = true;
    while (core->is_running && !soc.is_broken && core->n_instructions < n_max)
        pru_core_step(core);
    return core->is_running || soc.is_broken ? NULL : soc.data[0];
}

uint64_t
pru_read_cycles(void)
{
    return soc.cores[0].cycle;
}

const struct vmcu_ops *
vmcu_get_ops(void)
{
    static const struct vmcu_ops ops = {
        .abi_version = VMCU_ABI_VERSION, .clock_freq = PRU_HZ,
        .n_pins = N_PINS + N_ANALOG, .name = "pru", .power_on = power_on,
        .rx = rx, .run = run, .find_pin = find_pin, .power_off = power_off,
    };

    return &ops;
}
