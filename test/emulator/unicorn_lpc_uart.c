/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * UARTs of an LPC176x, with their fifos (UM10360, chapter 14).  regs[]: 1 IER,
 * 2 FCR, 3 LCR, 8 divider.
 */
#include "unicorn_lpc.h"

enum { RBR = 0, IER = 4, IIR = 8, LCR = 0xc, LSR = 0x14 };
enum { FIFO_SIZE = 16, DIVISOR = 8 };
enum { LSR_RDR = 1, LSR_OE = 2, LSR_THRE = 0x20, LSR_TEMT = 0x40 };

static struct fifos {
    uint8_t rx[FIFO_SIZE], tx[FIFO_SIZE], sending;
    uint32_t n_rx, n_tx;
    bool overrun, thre_pending;
} fifos[4];

/* Where a UART's input may be: pin and function */
static const struct {
    uint8_t uart, pin, function;
} inputs[] = {
    { 0, 3, 1 }, { 1, 16, 1 }, { 1, 65, 2 }, { 2, 11, 1 }, { 2, 73, 2 },
    { 3, 1, 2 }, { 3, 26, 3 }, { 3, 157, 3 },
};

static struct fifos *
fifos_of(const struct device *d)
{
    return &fifos[d->info->index];
}

static bool
is_connected(const struct device *d)
{
    uint32_t i;

    for (i = 0; i < sizeof(inputs) / sizeof(inputs[0]); i++)
        if (inputs[i].uart == d->info->index
            && lpc_function_of(inputs[i].pin) == inputs[i].function)
            return true;
    return false;
}

static void
update_irq(struct device *d)
{
    const struct fifos *f = fifos_of(d);

    core_set_pending(16u + d->info->irq,
                     (d->regs[1] & 1 && f->n_rx)
                     || (d->regs[1] & 2 && f->thre_pending));
}

static uint64_t
byte_cycles(struct device *d)
{
    uint32_t divider = d->regs[DIVISOR] & 0xffff;

    if (!divider || !is_connected(d)) {
        chip_fault("uart %u without a divider or pins", d->info->index);
        return 0;
    }
    return bus_byte_cycles((double)chip.core_hz / lpc_divider(d) / 16
                           / divider);
}

/* The fifo feeds the shift register; empty, it says so once. */
static void
start_tx(struct device *d)
{
    struct fifos *f = fifos_of(d);
    uint32_t i;

    if (!f->n_tx || d->due != NEVER)
        return;
    f->sending = f->tx[0];
    f->n_tx--;
    for (i = 0; i < f->n_tx; i++)
        f->tx[i] = f->tx[i + 1];
    if (!f->n_tx)
        f->thre_pending = true;
    bus_plan(d, byte_cycles(d));
}

static void
uart_event(struct device *d)
{
    chip.host.tx(chip.host.ctx, chip_now(), &fifos_of(d)->sending, 1);
    start_tx(d);
    update_irq(d);
}

static uint8_t
take_rx(struct fifos *f)
{
    uint8_t byte = f->rx[0];
    uint32_t i;

    if (!f->n_rx)
        return 0;
    f->n_rx--;
    for (i = 0; i < f->n_rx; i++)
        f->rx[i] = f->rx[i + 1];
    return byte;
}

static uint32_t
read_lsr(struct device *d)
{
    struct fifos *f = fifos_of(d);
    uint32_t lsr = (f->n_rx ? LSR_RDR : 0) | (f->overrun ? LSR_OE : 0)
        | (f->n_tx ? 0 : LSR_THRE)
        | (f->n_tx || d->due != NEVER ? 0 : LSR_TEMT);

    f->overrun = false;
    return lsr;
}

/* Which interrupt; that of an empty fifo is gone once it was told. */
static uint32_t
read_iir(struct device *d)
{
    struct fifos *f = fifos_of(d);

    if (d->regs[1] & 1 && f->n_rx)
        return 0xc4;
    if (!(d->regs[1] & 2) || !f->thre_pending)
        return 0xc1;
    f->thre_pending = false;
    return 0xc2;
}

static uint32_t
uart_read(struct device *d, uint32_t offset)
{
    bool dlab = d->regs[3] & 0x80;
    uint32_t value = d->regs[offset / 4];

    if (offset == LSR)
        value = read_lsr(d);
    else if (offset == IIR)
        value = read_iir(d);
    else if (offset == RBR && !dlab)
        value = take_rx(fifos_of(d));
    update_irq(d);
    return value;
}

static void
write_thr(struct device *d, uint8_t byte)
{
    struct fifos *f = fifos_of(d);

    if (f->n_tx == FIFO_SIZE || !(d->regs[2] & 1)) {
        chip_fault("uart %u: fifo full or off", d->info->index);
        return;
    }
    f->tx[f->n_tx++] = byte;
    f->thre_pending = false;
    start_tx(d);
}

static void
uart_write(struct device *d, uint32_t offset, uint32_t value)
{
    bool dlab = d->regs[3] & 0x80;

    if (offset == RBR && dlab)
        d->regs[DIVISOR] = (d->regs[DIVISOR] & 0xff00) | (value & 255);
    else if (offset == IER && dlab)
        d->regs[DIVISOR] = (d->regs[DIVISOR] & 0xff) | (value & 255) << 8;
    else if (offset == RBR)
        write_thr(d, (uint8_t)value);
    else
        d->regs[offset / 4] = value;
    if (offset == IER && !dlab && value & 1)
        chip.console = d;
    if (offset == LCR && !(value & 0x80) && value != 3)
        chip_fault("uart %u: not 8 bits without parity", d->info->index);
    update_irq(d);
}

static void
uart_reset(struct device *d)
{
    *fifos_of(d) = (struct fifos) { .n_rx = 0 };
    d->regs[DIVISOR] = 1;
}

const struct device_ops lpc_uart_ops = {
    uart_reset, uart_read, uart_write, uart_event,
};

void
lpc_rx(uint8_t byte)
{
    struct device *d = chip.console;
    struct fifos *f = fifos_of(d);
    uint64_t cycles = byte_cycles(d);

    if (!cycles)
        return;
    d->next_rx = chip.cycle + cycles;
    if (f->n_rx == FIFO_SIZE)
        f->overrun = true;
    else
        f->rx[f->n_rx++] = byte;
    update_irq(d);
}
