/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * CAN of SAM C21 and E5x (DS60001479, 34; DS60001507, 39): an M_CAN whose
 * memory is the first 64 KiB of the processor's.
 */
#include <string.h>

#include "unicorn_can.h"
#include "unicorn_samd.h"

enum { MEMORY_SIZE = 0x10000 };

/* What the model of an M_CAN knows of each of the two */
static struct device units[2];
static struct device_info infos[2];
static struct samd_device *owners[2];

static void *
find_memory(const struct device *d, uint32_t offset)
{
    (void)d;
    return chip.ram + (offset <= chip.model->ram_size - 16 ? offset : 0);
}

static uint32_t
clock_hz(const struct device *d)
{
    return samd_feed_hz(owners[d->info->index]);
}

static bool
has_clock(const struct device *d)
{
    const struct samd_info *info = owners[d->info->index]->info;

    return samd_get(samd.gates, info->gate_offset, 4) >> info->gate_bit & 1;
}

/* Pairs of pins: receive, send, and their function (A is 0) */
static void
check(const struct device *d)
{
    static const struct pair { uint8_t index, rx, tx, mux; } c21[] = {
        { 0, 23, 22, 6 }, { 0, 25, 24, 6 }, { 1, 32 + 11, 32 + 10, 6 },
        { 1, 32 + 15, 32 + 14, 6 } }, e51[] = {
        { 0, 23, 22, 8 }, { 0, 25, 24, 8 }, { 1, 32 + 13, 32 + 12, 7 },
        { 1, 32 + 15, 32 + 14, 7 } };
    const struct pair *pins = samd.line == SAMC21 ? c21 : e51;
    uint32_t i;

    for (i = 0; i < 4; i++)
        if (pins[i].index == d->info->index
            && samd_mux_of(pins[i].rx) == pins[i].mux
            && samd_mux_of(pins[i].tx) == pins[i].mux)
            return;
    chip_fault("CAN %u has no pins", d->info->index);
}

void
samd_can_reset(struct samd_device *d)
{
    static const struct mcan_family family = {
        .memory_size = MEMORY_SIZE, .memory = find_memory,
        .clock_hz = clock_hz, .has_clock = has_clock, .check = check };
    uint8_t i = d->info->index;

    infos[i] = (struct device_info) { .base = d->info->base, .index = i,
                                      .irq = d->info->irq };
    memset(&units[i], 0, sizeof(units[i]));
    units[i].info = &infos[i];
    owners[i] = d;
    mcan_reset(&units[i], &family);
}

uint32_t
samd_can_read(struct samd_device *d, uint32_t offset, uint32_t size)
{
    if (size != 4)
        chip_fault("%u bytes of CAN are read", size);
    return mcan_read(&units[d->info->index], offset / 4);
}

void
samd_can_write(struct samd_device *d, uint32_t offset, uint32_t size,
               uint32_t value)
{
    if (size != 4)
        chip_fault("%u bytes of CAN are written", size);
    mcan_write(&units[d->info->index], offset / 4, value);
}
