/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A bus of peripherals: which one is meant, and whether it has a clock.
 */
#include <string.h>

#include "unicorn_bus.h"
#include "unicorn_canhost.h"

static const struct bus *bus;

static struct device *
find_device(uint32_t addr)
{
    struct device *found = NULL;
    uint32_t i, nearest = MAX_REGS * 4;

    for (i = 0; i < chip.n_devices; i++) {
        struct device *d = &chip.devices[i];

        if (addr - d->info->base < nearest) {
            nearest = addr - d->info->base;
            found = d;
        }
    }
    if (!found)
        chip_fault("nothing is modelled at 0x%08x", addr);
    else if (!bus->has_clock(found))
        chip_fault("0x%08x has no clock", addr);
    return chip.is_broken ? NULL : found;
}

static uint64_t
bus_read(uc_engine *uc, uint64_t offset, unsigned size, void *param)
{
    uint32_t addr = (uint32_t)((uintptr_t)param + offset);
    struct device *d = find_device(addr);

    (void)uc;
    if (d && (size != 4 || addr & 3))
        chip_fault("%u bytes read at 0x%08x", size, addr);
    if (chip.is_broken)
        return 0;
    addr -= d->info->base;
    return bus->kinds[d->info->kind]->read
        ? bus->kinds[d->info->kind]->read(d, addr) : d->regs[addr / 4];
}

static void
bus_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value,
          void *param)
{
    uint32_t addr = (uint32_t)((uintptr_t)param + offset);
    struct device *d = find_device(addr);

    (void)uc;
    if (d && (size != 4 || addr & 3))
        chip_fault("%u bytes written to 0x%08x", size, addr);
    if (chip.is_broken)
        return;
    addr -= d->info->base;
    if (bus->kinds[d->info->kind]->write)
        bus->kinds[d->info->kind]->write(d, addr, (uint32_t)value);
    else
        d->regs[addr / 4] = (uint32_t)value;
}

void
bus_map(uc_engine *uc, const struct bus *family_bus)
{
    uint32_t i;

    bus = family_bus;
    for (i = 0; i < 4 && bus->areas[i].size; i++) {
        void *base = (void *)(uintptr_t)bus->areas[i].base;

        if (uc_mmio_map(uc, bus->areas[i].base, bus->areas[i].size, bus_read,
                        base, bus_write, base))
            chip_fault("no peripherals");
    }
}

void
bus_reset(void)
{
    const struct device_info *info = chip.model->devices;
    uint32_t i;

    chip.core_hz = chip.model->hsi_hz;
    for (; info->base; info++) {
        struct device *d = &chip.devices[chip.n_devices++];

        memset(d, 0, sizeof(*d));
        d->info = info;
        d->due = NEVER;
    }
    for (i = 0; i < chip.n_devices; i++) {
        struct device *d = &chip.devices[i];

        if (bus->kinds[d->info->kind]->reset)
            bus->kinds[d->info->kind]->reset(d);
    }
    canhost_reset();
}

void
bus_run_events(void)
{
    uint32_t i;

    for (i = 0; i < chip.n_devices; i++) {
        struct device *d = &chip.devices[i];

        if (chip.cycle < d->due)
            continue;
        d->due = NEVER;
        bus->kinds[d->info->kind]->event(d);
    }
    canhost_run_events();
}

uint64_t
bus_next_event(void)
{
    uint64_t next = canhost_next_event();
    uint32_t i;

    for (i = 0; i < chip.n_devices; i++)
        if (chip.devices[i].due < next)
            next = chip.devices[i].due;
    return next;
}

uint64_t
bus_rx_free_at(void)
{
    if (canhost_is_used())
        return canhost_free_at();
    return chip.console ? chip.console->next_rx : NEVER;
}

struct device *
bus_find(uint8_t kind, uint8_t index)
{
    uint32_t i;

    for (i = 0; i < chip.n_devices; i++)
        if (chip.devices[i].info->kind == kind
            && chip.devices[i].info->index == index)
            return &chip.devices[i];
    return NULL;
}

void
bus_plan(struct device *d, uint64_t cycles)
{
    d->due = chip.cycle + cycles;
    chip_wake_at(d->due);
}

void
bus_drive(struct device *d, uint32_t latch, uint32_t driven)
{
    /* a pin that begins to be driven had no level before */
    uint32_t changed = ((d->out ^ latch) | ~d->driven) & driven, bit;

    d->driven = driven;
    d->out = latch;
    while (changed) {
        bit = (uint32_t)__builtin_ctz(changed);
        changed &= changed - 1;
        chip.host.pin_out(chip.host.ctx, chip_now(), d->info->index * 32 + bit,
                          (latch >> bit) & 1);
    }
}

uint64_t
bus_byte_cycles(double baud)
{
    if (baud < chip.baud * .97 || baud > chip.baud * 1.03) {
        chip_fault("uart at %.0f baud instead of %u", baud, chip.baud);
        return 0;
    }
    return (uint64_t)(10. * chip.core_hz / baud);
}
