/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Pins of SAM3X, SAM4 and SAM E70 (11057, chapter 31; 11100, chapter 31).
 */
#include "unicorn_sam.h"

enum { PER = 0, PDR = 4, PSR = 8, OER = 0x10, ODR = 0x14, OSR = 0x18,
       SODR = 0x30, CODR = 0x34, ODSR = 0x38, PDSR = 0x3c, MDER = 0x50,
       MDDR = 0x54, MDSR = 0x58, PUDR = 0x60, PUER = 0x64, PUSR = 0x68,
       ABCDSR1 = 0x70, ABCDSR2 = 0x74, PPDDR = 0x90, PPDER = 0x94,
       PPDSR = 0x98, OWER = 0xa0, OWDR = 0xa4, OWSR = 0xa8 };
enum { SYSIO = 0x114 };

/* Pins of port B, of a SAM3X of port C, that are the system's */
static uint32_t
system_pins(const struct device *d)
{
    uint32_t freed = bus_find(SAM_MATRIX, 0)->regs[SYSIO / 4];

    if (sam_line() == SAM3X)
        return d->info->index == 2 && !(freed & 1u << 12) ? 1 : 0;
    return d->info->index == 1 ? 0x1cf0 & ~freed : 0;
}

static void
update(struct device *d)
{
    bus_drive(d, d->regs[ODSR / 4],
              d->regs[PSR / 4] & d->regs[OSR / 4] & ~system_pins(d));
    sam_update_pwm();
}

uint32_t
sam_function_of(uint32_t pin)
{
    const struct device *d = bus_find(SAM_PIO, (uint8_t)(pin / 32));
    uint32_t bit = 1u << pin % 32;

    if (!d || system_pins(d) & bit)
        return UINT32_MAX;
    if (d->regs[PSR / 4] & bit)
        return d->regs[OSR / 4] & bit ? SAM_OUTPUT : SAM_INPUT;
    return (d->regs[ABCDSR1 / 4] & bit ? 1 : 0)
        | (d->regs[ABCDSR2 / 4] & bit ? 2 : 0);
}

/* PUSR says where there is no pull-up, PPDSR where no pull-down. */
static uint32_t
read_pins(struct device *d)
{
    uint32_t bit, pins = d->out & d->driven;

    if (!sam_is_on(d->info->irq))
        chip_fault("input of port %c without a clock", 'A' + d->info->index);
    for (bit = 0; bit < 32; bit++) {
        int8_t pull = !(d->regs[PUSR / 4] >> bit & 1) ? 1
            : !(d->regs[PPDSR / 4] >> bit & 1) ? -1 : 0;

        if (!(d->driven >> bit & 1)
            && chip.host.pin_in(chip.host.ctx, chip_now(),
                                d->info->index * 32u + bit, pull))
            pins |= 1u << bit;
    }
    return pins;
}

static uint32_t
pio_read(struct device *d, uint32_t offset)
{
    return offset == PDSR ? read_pins(d) : d->regs[offset / 4];
}

/* Both pulls at once cannot be. */
static void
set_pull(struct device *d, uint32_t reg, uint32_t other, uint32_t value)
{
    if (value & ~d->regs[other / 4])
        chip_fault("both pulls of port %c: 0x%08x", 'A' + d->info->index,
                   value);
    d->regs[reg / 4] &= ~value;
}

/* Registers that set or clear bits of a third one, which follows them */
static bool
write_pair(struct device *d, uint32_t offset, uint32_t value)
{
    switch (offset) {
    case PER:
    case OER:
    case MDER:
    case OWER:
        d->regs[offset / 4 + 2] |= value;
        return true;
    case PDR:
    case ODR:
    case MDDR:
    case OWDR:
        d->regs[offset / 4 + 1] &= ~value;
        return true;
    default:
        return false;
    }
}

static void
pio_write(struct device *d, uint32_t offset, uint32_t value)
{
    uint32_t *latch = &d->regs[ODSR / 4], mask = d->regs[OWSR / 4];

    if (sam_line() == SAM3X && (offset == ABCDSR2 || offset == PPDER))
        chip_fault("a SAM3X has no register at 0x%x", offset);
    if (write_pair(d, offset, value))
        ;
    else if (offset == SODR)
        *latch |= value;
    else if (offset == CODR)
        *latch &= ~value;
    else if (offset == ODSR)
        *latch = (*latch & ~mask) | (value & mask);
    else if (offset == PUDR || offset == PPDDR)
        d->regs[(offset == PUDR ? PUSR : PPDSR) / 4] |= value;
    else if (offset == PUER)
        set_pull(d, PUSR, PPDSR, value);
    else if (offset == PPDER)
        set_pull(d, PPDSR, PUSR, value);
    else
        d->regs[offset / 4] = value;
    update(d);
}

/* Inputs with a pull-up */
static void
pio_reset(struct device *d)
{
    d->regs[PSR / 4] = d->regs[PPDSR / 4] = UINT32_MAX;
}

const struct device_ops sam_pio_ops = { pio_reset, pio_read, pio_write, NULL };

static void
matrix_write(struct device *d, uint32_t offset, uint32_t value)
{
    uint8_t port;

    d->regs[offset / 4] = value;
    for (port = 0; port < 5; port++)
        if (bus_find(SAM_PIO, port))
            update(bus_find(SAM_PIO, port));
}

const struct device_ops sam_matrix_ops = { NULL, NULL, matrix_write, NULL };
