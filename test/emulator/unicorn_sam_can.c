/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * MCAN of the SAM E70 (DS60001527, 49): its memory is the processor's.
 */
#include "unicorn_can.h"
#include "unicorn_sam.h"

enum { CCFG_CAN0 = 0x110, CCFG_SYSIO = 0x114, MEMORY_SIZE = 0x10000 };

/* The upper half of the address is in a register of the matrix. */
static void *
find_memory(const struct device *d, uint32_t offset)
{
    uint32_t ccfg = d->info->index ? CCFG_SYSIO : CCFG_CAN0;
    uint32_t page = bus_find(SAM_MATRIX, 0)->regs[ccfg / 4] & 0xffff0000;
    uint32_t at = (page | offset) - chip.model->ram_base;

    if (at > chip.model->ram_size - 16) {
        chip_fault("CAN looks for its memory at 0x%08x", page | offset);
        at = 0;
    }
    if (core_is_cached(page | offset))
        chip_fault("CAN's memory at 0x%08x is cached", page | offset);
    return chip.ram + at;
}

static uint32_t
clock_hz(const struct device *d)
{
    uint32_t hz = sam_pck_hz(5);

    (void)d;
    if (hz >= chip.bus_hz[1])
        chip_fault("CAN counts %u Hz, more than the bus has", hz);
    return hz;
}

static void
check(const struct device *d)
{
    static const struct {
        uint16_t rx, tx;
        uint8_t rx_function, tx_function;
    } pins[] = { { 32 + 3, 32 + 2, 0, 0 }, { 64 + 12, 96 + 12, 2, 1 } };
    uint32_t i = d->info->index;

    if (sam_function_of(pins[i].rx) != pins[i].rx_function
        || sam_function_of(pins[i].tx) != pins[i].tx_function)
        chip_fault("CAN %u has no pins", i);
}

static void
can_reset(struct device *d)
{
    static const struct mcan_family family = {
        .memory_size = MEMORY_SIZE, .memory = find_memory,
        .clock_hz = clock_hz, .has_clock = sam_has_clock, .check = check };

    mcan_reset(d, &family);
}

static uint32_t
can_read(struct device *d, uint32_t offset)
{
    return mcan_read(d, offset / 4);
}

static void
can_write(struct device *d, uint32_t offset, uint32_t value)
{
    mcan_write(d, offset / 4, value);
}

const struct device_ops sam_can_ops = {
    can_reset, can_read, can_write, NULL,
};
