/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * M_CAN of the STM32, named FDCAN: its clock, and a memory for all of them
 * (RM0444, 36; RM0433, 59).
 */
#include <string.h>

#include "unicorn_can.h"

#define RAM_SIZE 0x2800

static uint8_t ram[RAM_SIZE];

uint32_t
fdcan_memory_read(uint32_t offset)
{
    uint32_t value = 0;

    if (offset < RAM_SIZE)
        memcpy(&value, &ram[offset], 4);
    return value;
}

void
fdcan_memory_write(uint32_t offset, uint32_t value)
{
    if (offset < RAM_SIZE)
        memcpy(&ram[offset], &value, 4);
}

static void *
find_memory(const struct device *d, uint32_t offset)
{
    (void)d;
    return &ram[offset < RAM_SIZE - 16 ? offset : 0];
}

/* Of the controller, by the registers that choose it. */
static uint32_t
clock_hz(const struct device *d)
{
    const uint32_t *regs = chip.rcc->regs;
    uint32_t m, n, q, source;

    (void)d;
    if (chip.model->line == LINE_G0)
        return regs[0x58 / 4] & (3u << 8) ? 0 : chip.bus_hz[1];
    if (chip.model->line == LINE_G4)
        return (regs[0x88 / 4] >> 24 & 3) == 2 ? chip.bus_hz[1] : 0;
    if ((regs[0x4c / 4 + 1] >> 28 & 3) != 1 || !(regs[11] & (1u << 17)))
        return 0;
    source = (regs[10] & 3) == 2 ? chip.hse_hz : 64000000;
    m = regs[10] >> 4 & 63;
    n = (regs[12] & 511) + 1;
    q = (regs[12] >> 16 & 127) + 1;
    return source / m * n / q;
}

static void
check(const struct device *d)
{
    (void)d;
}

void
fdcan_reset(struct device *d)
{
    static const struct mcan_family divided = {
        .is_divided = true, .memory_size = RAM_SIZE, .memory = find_memory,
        .clock_hz = clock_hz, .has_clock = rcc_has_clock, .check = check };
    static const struct mcan_family free = {
        .memory_size = RAM_SIZE, .memory = find_memory,
        .clock_hz = clock_hz, .has_clock = rcc_has_clock, .check = check };

    memset(ram, 0xa5, sizeof(ram));
    mcan_reset(d, chip.model->line == LINE_H7 ? &free : &divided);
}
