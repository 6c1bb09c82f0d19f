/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The model of a PIO block (RP2040 data sheet, 3.2, 3.4, 3.5, 3.7).
 */
#include <string.h>

#include "unicorn_pio.h"

enum { CTRL = 0x000, FSTAT = 0x004, FLEVEL = 0x00c, TXF = 0x010, RXF = 0x020,
       MEMORY = 0x048, SMS = 0x0c8, SMS_END = 0x128 };
enum { CLKDIV, EXECCTRL, SHIFTCTRL, ADDR, INSTR, PINCTRL, SM_WORDS };

static uint32_t
inte_offset(const struct pio *p)
{
    return p->is_2350 ? 0x170 : 0x12c;
}

void
pio_reset(struct pio *p, bool is_2350, void (*fault)(const char *))
{
    uint32_t i;

    memset(p, 0, sizeof(*p));
    p->is_2350 = is_2350;
    p->fault = fault;
    p->sync[0] = p->sync[1] = UINT32_MAX;
    for (i = 0; i < PIO_SMS; i++) {
        p->sm[i].clkdiv = 1u << 16;
        p->sm[i].execctrl = 0x1f000;
        p->sm[i].shiftctrl = 3u << 18;
        p->sm[i].pinctrl = 5u << 26;
    }
}

static void
put(struct pio_queue *q, uint32_t word)
{
    q->words[(q->first + q->count++) % PIO_DEPTH] = word;
}

static uint32_t
get(struct pio_queue *q)
{
    q->count--;
    return q->words[q->first++ % PIO_DEPTH];
}

/*
 * Instructions
 */

static uint32_t
rotate(uint32_t value, uint32_t by)
{
    return by ? value >> by | value << (32 - by) : value;
}

static uint32_t
read_pins(const struct pio *p, const struct pio_sm_state *sm)
{
    return rotate(p->sync[1], sm->pinctrl >> 15 & 31);
}

static void
write_pins(struct pio *p, uint32_t *to, uint32_t base, uint32_t count,
           uint32_t value)
{
    uint32_t i;

    (void)p;
    for (i = 0; i < count; i++) {
        uint32_t bit = 1u << (base + i) % 32;

        *to = value >> i & 1 ? *to | bit : *to & ~bit;
    }
}

static void
write_out(struct pio *p, struct pio_sm_state *sm, uint32_t *to, uint32_t value)
{
    write_pins(p, to, sm->pinctrl & 31, sm->pinctrl >> 20 & 63, value);
}

static bool
condition(struct pio *p, struct pio_sm_state *sm, uint32_t which)
{
    switch (which) {
    case 0:
        return true;
    case 1:
        return !sm->x;
    case 2:
        return sm->x-- != 0;
    case 3:
        return !sm->y;
    case 4:
        return sm->y-- != 0;
    case 5:
        return sm->x != sm->y;
    case 6:
        return p->sync[1] >> (sm->execctrl >> 24 & 31) & 1;
    default:
        p->fault("jmp !osre");
        return false;
    }
}

static uint32_t
read_source(struct pio *p, struct pio_sm_state *sm, uint32_t which)
{
    switch (which) {
    case 0:
        return read_pins(p, sm);
    case 1:
        return sm->x;
    case 2:
        return sm->y;
    case 3:
        return 0;
    case 6:
        return sm->isr;
    case 7:
        return sm->osr;
    default:
        p->fault("a source");
        return 0;
    }
}

static void
run_in(struct pio *p, struct pio_sm_state *sm, uint32_t op)
{
    uint32_t count = op & 31 ? op & 31 : 32;
    uint32_t mask = count == 32 ? UINT32_MAX : (1u << count) - 1;
    uint32_t value = read_source(p, sm, op >> 5 & 7) & mask;

    if (count == 32)
        sm->isr = value;
    else if (sm->shiftctrl >> 18 & 1)
        sm->isr = sm->isr >> count | value << (32 - count);
    else
        sm->isr = sm->isr << count | value;
}

static void
write_target(struct pio *p, struct pio_sm_state *sm, uint32_t which,
             uint32_t value)
{
    switch (which) {
    case 0:
        write_out(p, sm, &p->out, value);
        return;
    case 1:
        sm->x = value;
        return;
    case 2:
        sm->y = value;
        return;
    case 3:
        return;
    default:
        p->fault("a target");
    }
}

static void
run_out(struct pio *p, struct pio_sm_state *sm, uint32_t op)
{
    uint32_t count = op & 31 ? op & 31 : 32, value;
    uint32_t mask = count == 32 ? UINT32_MAX : (1u << count) - 1;

    if (sm->shiftctrl >> 19 & 1) {
        value = sm->osr & mask;
        sm->osr = count == 32 ? 0 : sm->osr >> count;
    } else {
        value = count == 32 ? sm->osr : sm->osr >> (32 - count);
        sm->osr = count == 32 ? 0 : sm->osr << count;
    }
    write_target(p, sm, op >> 5 & 7, value);
}

/* Returns whether it stalls. */
static bool
run_queue(struct pio *p, struct pio_sm_state *sm, uint32_t op)
{
    bool blocks = op >> 5 & 1;

    if (op >> 6 & 1)
        p->fault("push iffull, pull ifempty");
    if (op & 0x80) {
        if (sm->tx.count)
            sm->osr = get(&sm->tx);
        else if (!blocks)
            sm->osr = sm->x;
        else {
            p->n_waits++;
            return true;
        }
        return false;
    }
    if (sm->rx.count < PIO_DEPTH) {
        put(&sm->rx, sm->isr);
        p->pushed_at = p->cycle;
    } else if (blocks) {
        return true;
    } else {
        p->n_overruns++;
    }
    sm->isr = 0;
    return false;
}

static void
run_mov(struct pio *p, struct pio_sm_state *sm, uint32_t op)
{
    uint32_t value = read_source(p, sm, op & 7), which = op >> 5 & 7;

    if ((op >> 3 & 3) == 1)
        value = ~value;
    else if (op >> 3 & 3)
        p->fault("mov with bits reversed");
    if (which == 6)
        sm->isr = value;
    else if (which == 7)
        sm->osr = value;
    else
        write_target(p, sm, which, value);
}

static void
run_set(struct pio *p, struct pio_sm_state *sm, uint32_t op)
{
    uint32_t value = op & 31, base = sm->pinctrl >> 5 & 31;
    uint32_t count = sm->pinctrl >> 26 & 7;

    switch (op >> 5 & 7) {
    case 0:
        write_pins(p, &p->out, base, count, value);
        return;
    case 1:
        sm->x = value;
        return;
    case 2:
        sm->y = value;
        return;
    case 4:
        write_pins(p, &p->oe, base, count, value);
        return;
    default:
        p->fault("set");
    }
}

/* Returns whether the instruction stalls; *pc becomes that after it. */
static bool
execute(struct pio *p, struct pio_sm_state *sm, uint32_t op, uint32_t *pc)
{
    switch (op >> 13) {
    case 0:
        if (condition(p, sm, op >> 5 & 7))
            *pc = op & 31;
        return false;
    case 1:
        if ((op >> 5 & 3) != 1)
            p->fault("wait for no pin");
        return (read_pins(p, sm) >> (op & 31) & 1) != (op >> 7 & 1);
    case 2:
        run_in(p, sm, op);
        return false;
    case 3:
        run_out(p, sm, op);
        return false;
    case 4:
        return run_queue(p, sm, op);
    case 5:
        run_mov(p, sm, op);
        return false;
    case 7:
        run_set(p, sm, op);
        return false;
    default:
        p->fault("irq");
        return false;
    }
}

static void
clock_sm(struct pio *p, struct pio_sm_state *sm)
{
    uint32_t top = sm->execctrl >> 12 & 31, bottom = sm->execctrl >> 7 & 31;
    uint32_t op, next;

    if (sm->delay) {
        sm->delay--;
        return;
    }
    op = p->program[sm->pc];
    next = sm->pc == top ? bottom : (sm->pc + 1) & 31;
    sm->is_stalled = execute(p, sm, op, &next);
    if (sm->is_stalled)
        return;
    sm->pc = next;
    sm->delay = op >> 8 & 31;
}

void
pio_step(struct pio *p, uint32_t pads)
{
    uint32_t i;

    p->cycle++;
    for (i = 0; i < PIO_SMS; i++) {
        struct pio_sm_state *sm = &p->sm[i];
        uint32_t divider = sm->clkdiv >> 8;

        if (!(p->enabled >> i & 1))
            continue;
        sm->phase += 256;
        if (sm->phase < (divider ? divider : 1u << 24))
            continue;
        sm->phase -= divider ? divider : 1u << 24;
        clock_sm(p, sm);
    }
    p->sync[1] = p->sync[0];
    p->sync[0] = pads;
}

bool
pio_is_idle(const struct pio *p)
{
    uint32_t i;

    for (i = 0; i < PIO_SMS; i++) {
        const struct pio_sm_state *sm = &p->sm[i];

        if (p->enabled >> i & 1
            && (!sm->is_stalled || p->program[sm->pc] >> 13 != 1
                || p->sync[0] != p->sync[1]))
            return false;
    }
    return true;
}

bool
pio_irq(const struct pio *p)
{
    uint32_t i;

    for (i = 0; i < PIO_SMS; i++)
        if (p->inte >> i & 1 && p->sm[i].rx.count)
            return true;
    return false;
}

/*
 * Registers
 */

static uint32_t
read_fstat(const struct pio *p)
{
    uint32_t i, value = 0;

    for (i = 0; i < PIO_SMS; i++)
        value |= ((p->sm[i].rx.count == PIO_DEPTH ? 1u : 0)
                  | (p->sm[i].rx.count ? 0 : 1u << 8)
                  | (p->sm[i].tx.count == PIO_DEPTH ? 1u << 16 : 0)
                  | (p->sm[i].tx.count ? 0 : 1u << 24)) << i;
    return value;
}

static uint32_t
read_sm(const struct pio_sm_state *sm, uint32_t word)
{
    switch (word) {
    case CLKDIV:
        return sm->clkdiv;
    case EXECCTRL:
        return sm->execctrl;
    case SHIFTCTRL:
        return sm->shiftctrl;
    case ADDR:
        return sm->pc;
    default:
        return sm->pinctrl;
    }
}

uint32_t
pio_read(struct pio *p, uint32_t offset)
{
    if (offset == CTRL)
        return p->enabled;
    if (offset == FSTAT)
        return read_fstat(p);
    if (offset >= RXF && offset < RXF + 16) {
        struct pio_queue *q = &p->sm[(offset - RXF) / 4].rx;

        if (q->count)
            return get(q);
        p->fault("an empty queue is read");
        return 0;
    }
    if (offset >= SMS && offset < SMS_END)
        return read_sm(&p->sm[(offset - SMS) / 4 / SM_WORDS],
                       (offset - SMS) / 4 % SM_WORDS);
    if (offset == inte_offset(p))
        return p->inte;
    p->fault("a register is read that is not modelled");
    return 0;
}

static void
write_sm(struct pio *p, struct pio_sm_state *sm, uint32_t word, uint32_t value)
{
    uint32_t next = sm->pc;

    switch (word) {
    case CLKDIV:
        sm->clkdiv = value;
        return;
    case EXECCTRL:
        sm->execctrl = value;
        if (value >> 30 & 1)
            p->fault("side-set");
        return;
    case SHIFTCTRL:
        if ((sm->shiftctrl ^ value) >> 30)
            sm->rx.count = sm->tx.count = 0;
        sm->shiftctrl = value;
        return;
    case INSTR:
        /* at once, even if the program stalls; not its delay if disabled */
        if (execute(p, sm, value & 0xffff, &next))
            p->fault("an instruction that is forced stalls");
        if (next != sm->pc) {
            sm->pc = next;
            sm->is_stalled = false;
        }
        sm->delay = 0;
        return;
    case PINCTRL:
        sm->pinctrl = value;
        return;
    default:
        p->fault("a register that is read only is written");
    }
}

static void
write_ctrl(struct pio *p, uint32_t value)
{
    uint32_t i;

    p->enabled = value & 15;
    for (i = 0; i < PIO_SMS; i++) {
        struct pio_sm_state *sm = &p->sm[i];

        /* 3.7 SM_RESTART: not pc, x, y, osr's contents */
        if (value >> (4 + i) & 1) {
            sm->isr = sm->delay = 0;
            sm->is_stalled = false;
        }
        if (value >> (8 + i) & 1)
            sm->phase = 0;
    }
}

void
pio_write(struct pio *p, uint32_t offset, uint32_t value)
{
    if (offset == CTRL) {
        write_ctrl(p, value);
    } else if (offset >= TXF && offset < TXF + 16) {
        struct pio_sm_state *sm = &p->sm[(offset - TXF) / 4];

        if (sm->tx.count == PIO_DEPTH)
            p->fault("a full queue is written");
        else
            put(&sm->tx, value);
        if (p->pushed_at && p->cycle - p->pushed_at > p->most_cycles)
            p->most_cycles = p->cycle - p->pushed_at;
        p->pushed_at = 0;
    } else if (offset >= MEMORY && offset < MEMORY + 128) {
        p->program[(offset - MEMORY) / 4] = (uint16_t)value;
    } else if (offset >= SMS && offset < SMS_END) {
        write_sm(p, &p->sm[(offset - SMS) / 4 / SM_WORDS],
                 (offset - SMS) / 4 % SM_WORDS, value);
    } else if (offset == inte_offset(p)) {
        p->inte = value;
    } else {
        p->fault("a register is written that is not modelled");
    }
}
