/* SPDX-License-Identifier: GPL-3.0-or-later
 * The simulated mcu as a virtual world sees it (vmcu_abi.h). */
#include <stdlib.h>
#include <string.h>

#include "board/irq.h"
#include "board/reset.h"
#include "world.h"
#include "port.h"

static int32_t mcu_power_on(const struct vmcu_host *host, uint64_t clock)
{
    simulator_restore_memory();
    memset(&simulator, 0, sizeof(simulator));
    simulator.host = host;
    simulator.now = simulator.until = clock;
    simulator.timer = (uint32_t)clock;
    coroutine_start(sched_main);
    coroutine_enter();
    return 0;
}

static uint64_t mcu_run(uint64_t until_clock)
{
    if (until_clock > simulator.until)
        simulator.until = until_clock;
    coroutine_enter();
    return simulator_next_event();
}

/* What was due before the bytes came happens first. */
static int32_t mcu_rx(uint64_t clock, const uint8_t *buf, uint32_t len)
{
    if (clock > simulator.until)
        mcu_run(clock);
    return simulator_console_rx(buf, len);
}

static int32_t mcu_find_pin(const char *name)
{
    char *end;
    long pin;

    if (!strcmp(name, "ADC_TEMPERATURE"))
        return SIMULATOR_PIN_TEMPERATURE;
    if (strncmp(name, "gpio", 4) || name[4] < '0' || name[4] > '9')
        return -1;
    pin = strtol(name + 4, &end, 10);
    return *end || pin >= SIMULATOR_PINS ? -1 : (int32_t)pin;
}

static void mcu_power_off(void)
{
}

void reset_mcu(void)
{
    simulator.host->reset(simulator.host->ctx, simulator_clock());
}

__attribute__((visibility("default")))
const struct vmcu_ops *vmcu_get_ops(void)
{
    static const struct vmcu_ops ops = {
        .abi_version = VMCU_ABI_VERSION,
        .clock_freq = CONFIG_CLOCK_FREQ,
        .n_pins = SIMULATOR_PINS,
        .name = CONFIG_MCU,
        .power_on = mcu_power_on,
        .rx = mcu_rx,
        .run = mcu_run,
        .find_pin = mcu_find_pin,
        .power_off = mcu_power_off,
    };

    return &ops;
}
