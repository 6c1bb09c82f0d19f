/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Instructions of a Programmable Real-time Unit.
 */
#include <string.h>

#include "pru_core.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
               "fields of registers are read in place");

enum { EVENT_REG = 31, DEVICE_MAC = 0, DEVICE_FILL = 254, DEVICE_ZERO = 255,
       LENGTH_IN_R0 = 124, MAC_STATUS_REG = 25, MAC_RESULT_REG = 26,
       MAC_FACTOR_REG = 28 };

static uint32_t
bits(uint32_t word, unsigned low, unsigned count)
{
    return (word >> low) & ((1u << count) - 1);
}

/*
 * Registers and their fields: a selector names byte, half word or all.
 */

static const uint8_t field_shift[8] = { 0, 8, 16, 24, 0, 8, 16, 0 };
static const uint8_t field_bits[8] = { 8, 8, 8, 8, 16, 16, 16, 32 };

static uint32_t
field_mask(uint32_t selector)
{
    return field_bits[selector] == 32 ? UINT32_MAX
        : (1u << field_bits[selector]) - 1;
}

static uint32_t
read_field(struct pru_core *core, uint32_t reg, uint32_t selector)
{
    uint32_t word = reg == EVENT_REG ? core->bus->read_r31(core)
        : core->regs.words[reg];

    return (word >> field_shift[selector]) & field_mask(selector);
}

static void
write_field(struct pru_core *core, uint32_t reg, uint32_t selector,
            uint32_t value)
{
    uint32_t mask = field_mask(selector) << field_shift[selector];

    value = (value << field_shift[selector]) & mask;
    if (reg == EVENT_REG)
        core->bus->write_r31(core, value);
    else
        core->regs.words[reg] = (core->regs.words[reg] & ~mask) | value;
}

static uint32_t
read_first(struct pru_core *core, uint32_t op)
{
    return read_field(core, bits(op, 8, 5), bits(op, 13, 3));
}

/* A register's field or a number of 8 bits. */
static uint32_t
read_second(struct pru_core *core, uint32_t op)
{
    if (bits(op, 24, 1))
        return bits(op, 16, 8);
    return read_field(core, bits(op, 16, 5), bits(op, 21, 3));
}

static void
write_result(struct pru_core *core, uint32_t op, uint32_t value)
{
    write_field(core, bits(op, 0, 5), bits(op, 5, 3), value);
}

/*
 * Arithmetic.  The carry comes out of the result's own width.
 */

static uint32_t
add(struct pru_core *core, uint32_t op, uint64_t sum)
{
    core->carry = (sum >> field_bits[bits(op, 5, 3)]) & 1;
    return (uint32_t)sum;
}

static uint32_t
calculate(struct pru_core *core, uint32_t op)
{
    uint32_t a = read_first(core, op), b = read_second(core, op);
    bool carry = core->carry;

    switch (bits(op, 25, 4)) {
    case 0: return add(core, op, (uint64_t)a + b);
    case 1: return add(core, op, (uint64_t)a + b + carry);
    case 2: return add(core, op, (uint64_t)a - b);
    case 3: return add(core, op, (uint64_t)a - b - carry);
    case 4: return a << (b & 31);
    case 5: return a >> (b & 31);
    case 6: return add(core, op, (uint64_t)b - a);
    case 7: return add(core, op, (uint64_t)b - a - carry);
    case 8: return a & b;
    case 9: return a | b;
    case 10: return a ^ b;
    case 11: return ~a;
    case 12: return a < b ? a : b;
    case 13: return a > b ? a : b;
    case 14: return a & ~(1u << (b & 31));
    default: return a | (1u << (b & 31));
    }
}

/* The highest bit of a that is as the lowest one of b; 32: none. */
static uint32_t
find_bit(uint32_t a, uint32_t b)
{
    uint32_t word = b & 1 ? a : ~a;

    return word ? 31 - (uint32_t)__builtin_clz(word) : 32;
}

/*
 * Transfers to other units over the wide bus: the multiplier, and constants.
 */

static uint32_t
burst_length(struct pru_core *core, uint32_t length)
{
    return length < LENGTH_IN_R0 ? length + 1
        : core->regs.bytes[length - LENGTH_IN_R0];
}

static uint64_t
multiply(const struct pru_core *core)
{
    return (uint64_t)core->regs.words[MAC_FACTOR_REG]
        * core->regs.words[MAC_FACTOR_REG + 1];
}

/* What the multiplier shows at r25 to r27. */
static void
read_mac(struct pru_core *core, uint8_t *unit)
{
    uint64_t value = core->mac_mode & 1 ? core->mac_sum : multiply(core);

    unit[MAC_STATUS_REG * 4] = core->mac_mode;
    memcpy(unit + MAC_RESULT_REG * 4, &value, sizeof(value));
}

static void
write_mac(struct pru_core *core, uint32_t first, uint32_t len)
{
    if (first > MAC_STATUS_REG * 4 || first + len <= MAC_STATUS_REG * 4)
        return;
    core->mac_mode = core->regs.bytes[MAC_STATUS_REG * 4] & 1;
    if (core->regs.bytes[MAC_STATUS_REG * 4] & 2)
        core->mac_sum = 0;
    else if (core->mac_mode)
        core->mac_sum += multiply(core);
}

static void
transfer(struct pru_core *core, uint32_t op)
{
    uint32_t kind = bits(op, 23, 2), device = bits(op, 15, 8);
    uint32_t first = bits(op, 0, 5) * 4 + bits(op, 5, 2);
    uint32_t len = burst_length(core, bits(op, 7, 7));
    uint8_t unit[PRU_REGS * 4] = { 0 };

    if (bits(op, 14, 1) || (device && device < DEVICE_FILL)
        || first + len > sizeof(unit)) {
        core->bus->fault(core, "no such unit at the wide bus", device);
        return;
    }
    if (kind == 2 && device == DEVICE_MAC)
        write_mac(core, first, len);
    if (kind != 1)
        return;
    if (device == DEVICE_FILL)
        memset(unit, 0xff, sizeof(unit));
    if (device == DEVICE_MAC)
        read_mac(core, unit);
    memcpy(core->regs.bytes + first, unit + first, len);
}

/*
 * Where to go on.  All return the next pc.
 */

static uint32_t
jump_target(struct pru_core *core, uint32_t op)
{
    return bits(op, 24, 1) ? bits(op, 8, 16)
        : read_field(core, bits(op, 16, 5), bits(op, 21, 3));
}

/* The body follows; it ends before pc + offset. */
static uint32_t
start_loop(struct pru_core *core, uint32_t op)
{
    uint32_t count = read_second(core, op), end = core->pc + bits(op, 0, 8);

    if (bits(op, 24, 1))
        count++;
    if (!count)
        return end;
    core->loop_start = core->pc + 1;
    core->loop_end = end;
    core->loop_left = count;
    return core->loop_start;
}

static uint32_t
control(struct pru_core *core, uint32_t op)
{
    uint32_t next = core->pc + 1;

    switch (bits(op, 25, 4)) {
    case 0:
        return jump_target(core, op);
    case 1: {
        uint32_t target = jump_target(core, op);
        write_result(core, op, next);
        return target;
    }
    case 2:
        write_result(core, op, bits(op, 8, 16));
        return next;
    case 3:
        write_result(core, op, find_bit(read_first(core, op),
                                        read_second(core, op)));
        return next;
    case 5:
        core->is_running = false;
        return next;
    case 7:
        transfer(core, op);
        return next;
    case 8:
        return start_loop(core, op);
    default:
        core->bus->fault(core, "no such instruction", op);
        return next;
    }
}

static uint32_t
branch_target(const struct pru_core *core, uint32_t op)
{
    uint32_t offset = bits(op, 25, 2) << 8 | bits(op, 0, 8);

    if (offset & 0x200)
        offset |= ~UINT32_C(0x3ff);
    return core->pc + offset;
}

static uint32_t
branch(struct pru_core *core, uint32_t op)
{
    uint32_t a = read_first(core, op), b = read_second(core, op);
    bool is_taken = (bits(op, 29, 1) && b > a) || (bits(op, 28, 1) && b == a)
        || (bits(op, 27, 1) && b < a);

    return is_taken ? branch_target(core, op) : core->pc + 1;
}

static uint32_t
branch_on_bit(struct pru_core *core, uint32_t op)
{
    uint32_t bit = read_first(core, op) >> (read_second(core, op) & 31) & 1;
    bool is_taken = bit ? bits(op, 28, 1) : bits(op, 27, 1);

    return is_taken ? branch_target(core, op) : core->pc + 1;
}

/*
 * Memory
 */

static void
access_memory(struct pru_core *core, uint32_t op, uint32_t base)
{
    uint32_t first = bits(op, 0, 5) * 4 + bits(op, 5, 2);
    uint32_t addr = base + read_second(core, op);
    uint32_t len = burst_length(core, bits(op, 25, 3) << 4
                                | bits(op, 13, 3) << 1 | bits(op, 7, 1));

    if (first + len > EVENT_REG * 4) {
        core->bus->fault(core, "a burst beyond r30", addr);
        return;
    }
    if (!len)
        return;
    core->cycle += bits(op, 28, 1)
        ? core->bus->load(core, addr, core->regs.bytes + first, len)
        : core->bus->store(core, addr, core->regs.bytes + first, len);
}

void
pru_core_step(struct pru_core *core)
{
    uint32_t op, next;

    if (core->pc >= PRU_CODE_WORDS) {
        core->bus->fault(core, "ran out of its code", core->pc);
        return;
    }
    op = core->code[core->pc];
    next = core->pc + 1;
    core->cycle++;
    core->n_instructions++;
    switch (bits(op, 29, 3)) {
    case 0:
        write_result(core, op, calculate(core, op));
        break;
    case 1:
        next = control(core, op);
        break;
    case 2:
    case 3:
        next = branch(core, op);
        break;
    case 4:
        access_memory(core, op, core->constants[bits(op, 8, 5)]);
        break;
    case 6:
        next = branch_on_bit(core, op);
        break;
    case 7:
        access_memory(core, op, core->regs.words[bits(op, 8, 5)]);
        break;
    default:
        core->bus->fault(core, "no such instruction", op);
        break;
    }
    if (core->loop_left && next == core->loop_end && --core->loop_left)
        next = core->loop_start;
    core->pc = next;
}

void
pru_core_reset(struct pru_core *core, const struct pru_bus *bus, uint32_t index)
{
    memset(core, 0, sizeof(*core));
    memset(&core->regs, 0xa5, sizeof(core->regs));
    core->bus = bus;
    core->index = index;
}
