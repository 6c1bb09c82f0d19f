/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Contract between a virtual world and one virtual micro-controller.
 *
 * A virtual mcu is a shared object that exports vmcu_get_ops().  The world
 * opens a private copy of the file per instance, so globals are per mcu.  All
 * calls come from one thread.  Clocks are 64 bit counts of the mcu's own
 * ticks, starting at the clock given to power_on(); the mcu never sees
 * host time.  Execution takes no virtual time of its own unless the mcu models
 * it (a cycle-exact emulator does).
 *
 * The world guarantees: rx(), run() and power_on() get clocks that never go
 * back.  The mcu guarantees: run(until) handles every own event up to and
 * including `until` and returns the clock of its next event (> until), or
 * UINT64_MAX when only input could wake it.  All callbacks are made from inside
 * these calls, with clocks in order, and must not re-enter the mcu.
 */
#ifndef VMCU_ABI_H
#define VMCU_ABI_H

#include <stdint.h>

enum { VMCU_ABI_VERSION = 1 };

/* Services of the world; `ctx` is passed back unchanged. */
struct vmcu_host {
    void *ctx;
    /* Bytes leave the mcu's console. */
    void (*tx)(void *ctx, uint64_t clock, const uint8_t *buf, uint32_t len);
    /* A gpio output changed its level. */
    void (*pin_out)(void *ctx, uint64_t clock, uint32_t pin, uint8_t level);
    /* Level at a gpio input; pull is -1 (down), 0 (none) or 1 (up). */
    uint8_t (*pin_in)(void *ctx, uint64_t clock, uint32_t pin, int8_t pull);
    /* Voltage at an analog input, 0..65535 of the reference voltage. */
    uint16_t (*adc_in)(void *ctx, uint64_t clock, uint32_t pin);
    /* A hardware pwm output changed: on for value/max of each cycle. */
    void (*pwm_out)(void *ctx, uint64_t clock, uint32_t pin,
                    uint32_t cycle_ticks, uint32_t value, uint32_t max);
    /* Full duplex transfer on a bus; cs and mode are the device's. */
    void (*spi)(void *ctx, uint64_t clock, uint32_t bus, uint8_t *buf,
                uint32_t len);
    /* Write then read; returns 0 or a negative error. */
    int32_t (*i2c)(void *ctx, uint64_t clock, uint32_t bus, uint8_t addr,
                   const uint8_t *wr, uint32_t wr_len, uint8_t *rd,
                   uint32_t rd_len);
    /* The mcu asks for its own reset; the world power-cycles it later. */
    void (*reset)(void *ctx, uint64_t clock);
    /* A timer ran later than it was scheduled, by `late` ticks. */
    void (*late)(void *ctx, uint64_t clock, uint64_t late);
};

struct vmcu_ops {
    uint32_t abi_version;
    uint32_t clock_freq;        /* nominal, Hz */
    uint32_t n_pins;
    const char *name;
    /* Boot.  Returns 0 or a negative error. */
    int32_t (*power_on)(const struct vmcu_host *host, uint64_t clock);
    /* Bytes arrive at the console; false: `len` did not fit, all dropped. */
    int32_t (*rx)(uint64_t clock, const uint8_t *buf, uint32_t len);
    uint64_t (*run)(uint64_t until_clock);
    /* Look up a pin number by its dictionary name, -1 if unknown. */
    int32_t (*find_pin)(const char *name);
    void (*power_off)(void);
};

const struct vmcu_ops *vmcu_get_ops(void);

#endif
