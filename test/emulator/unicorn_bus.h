/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A bus of peripherals, each of a kind with functions of its own; for families
 * that are no STM32.
 */
#ifndef UNICORN_BUS_H
#define UNICORN_BUS_H

#include "unicorn_chip.h"

/* How a kind of peripheral behaves; without a function it is plain memory. */
struct device_ops {
    void (*reset)(struct device *d);
    uint32_t (*read)(struct device *d, uint32_t offset);
    void (*write)(struct device *d, uint32_t offset, uint32_t value);
    void (*event)(struct device *d);    /* when it is due */
};

struct bus {
    const struct device_ops *const *kinds;    /* by device_info.kind */
    struct { uint32_t base, size; } areas[4];
    bool (*has_clock)(const struct device *d);
};

/* For the functions of a family. */
void bus_map(uc_engine *uc, const struct bus *bus);
void bus_reset(void);
void bus_run_events(void);
uint64_t bus_next_event(void);
uint64_t bus_rx_free_at(void);

struct device *bus_find(uint8_t kind, uint8_t index);
/* The peripheral's event comes in so many cycles from now. */
void bus_plan(struct device *d, uint64_t cycles);

/*
 * Pins of a port of 32: regs of the device are the family's, `out` and `driven`
 * are known here.
 */
/* The levels of the latch and which pins are driven: tells the world. */
void bus_drive(struct device *d, uint32_t latch, uint32_t driven);

/* Is the rate within 3 % of the console's?  Cycles of a byte, or 0 (a fault).
 */
uint64_t bus_byte_cycles(double baud);

#endif
