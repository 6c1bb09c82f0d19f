/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The nodes of a bit-level bus.  A node looks at the bus sixteen times a bit,
 * resynchronises as the standard says, keeps all levels of a frame, and reads
 * them anew with each bit.
 */
#include <stdlib.h>
#include <string.h>

#include "unicorn_can.h"
#include "unicorn_canwire.h"

enum { N_NODES = 4, N_QUEUE = 64, QUANTA = 16, SAMPLE = 13, JUMP = 3,
       MAX_RAW = 200, HISTORY = 256 };
enum state { LISTENING, RESTING, FRAME, FLAG, OTHERS_FLAG, DELIMITER, PAUSE };

struct order { struct can_frame frame; int32_t flip; };

struct node {
    double quantum, due;        /* cycles */
    uint32_t jitter;            /* cycles, at most */
    bool is_mute;               /* never acknowledges */
    enum state state;
    uint32_t phase, count;
    bool drive, next_drive, shown, last_sample, last_level;
    double show_at;
    uint8_t raw[MAX_RAW], bits[MAX_RAW];
    uint32_t n_raw, n_bits, arbitration_end;
    bool is_sender;
    struct order queue[N_QUEUE];
    uint32_t put, got;
    struct can_frame received[N_QUEUE];
    uint32_t n_received, n_taken;
    uint32_t n_errors, n_sent, n_lost, n_overloads, n_no_ack, n_dropped;
};

static struct {
    bool exists, is_shorted, is_open;
    uint32_t n_nodes, rx_pin, tx_pin, delay;
    uint8_t history[2][HISTORY];    /* what the chip sent, what the bus was */
    uint64_t cycle, n_dominant;
    struct node nodes[N_NODES];
} wire;

/*
 * Frames as levels
 */

static uint32_t
divide(const uint8_t *bits, uint32_t n)
{
    static const uint8_t divisor[16] = { 1, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 1, 1,
                                         0, 0, 1 };
    uint8_t work[MAX_RAW] = { 0 };
    uint32_t i, k, rest = 0;

    memcpy(work, bits, n);
    for (i = 0; i < n; i++)
        for (k = 0; work[i] && k < 16; k++)
            if (k)
                work[i + k] ^= divisor[k];
    for (k = 0; k < 15; k++)
        rest = rest << 1 | work[n + k];
    return rest;
}

static uint32_t
append(uint8_t *bits, uint32_t n, uint32_t value, uint32_t count)
{
    while (count--)
        bits[n++] = value >> count & 1;
    return n;
}

/* Levels of a frame up to the check sum's end. */
static void
compose(struct node *node, const struct order *order)
{
    const struct can_frame *f = &order->frame;
    uint8_t plain[MAX_RAW];
    uint32_t n, i, run = 0, arbitration, remote = f->id >> 30 & 1;

    n = append(plain, 0, 0, 1);
    if (f->id >> 31) {
        n = append(plain, n, f->id >> 18 & 0x7ff, 11);
        n = append(plain, n, 3, 2);
        n = append(plain, n, f->id & 0x3ffff, 18);
        arbitration = n = append(plain, n, remote, 1);
        n = append(plain, n, 0, 2);
    } else {
        n = append(plain, n, f->id & 0x7ff, 11);
        arbitration = n = append(plain, n, remote, 1);
        n = append(plain, n, 0, 2);
    }
    n = append(plain, n, f->len, 4);
    for (i = 0; !remote && i < f->len && i < 8; i++)
        n = append(plain, n, f->data[i], 8);
    n = append(plain, n, divide(plain, n), 15);
    node->n_bits = 0;
    for (i = 0; i < n; i++) {
        node->bits[node->n_bits++] = plain[i];
        run = i && plain[i] == node->bits[node->n_bits - 2] ? run + 1 : 1;
        if (run == 5) {
            node->bits[node->n_bits++] = !plain[i];
            run = 1;
        }
        if (i + 1 == arbitration)
            node->arbitration_end = node->n_bits;
    }
    if (order->flip >= 0 && (uint32_t)order->flip < node->n_bits)
        node->bits[order->flip] ^= 1;
}

struct reading {
    bool is_complete, is_stuffed_wrong, is_crc_right;
    uint32_t end;
    struct can_frame frame;
};

static uint32_t
number(const uint8_t *bits, uint32_t n)
{
    uint32_t value = 0;

    while (n--)
        value = value << 1 | *bits++;
    return value;
}

static uint32_t
find_total(const uint8_t *bits, uint32_t n)
{
    uint32_t base = n > 13 && bits[13] ? 39 : 19, len;

    if (n < base)
        return UINT32_MAX;
    len = number(&bits[base - 4], 4);
    if (bits[base == 39 ? 32 : 12])
        len = 0;
    return base + 8 * (len < 8 ? len : 8) + 15;
}

static void
finish(struct reading *r, const uint8_t *bits, uint32_t total, uint32_t end)
{
    bool extended = bits[13];
    uint32_t base = extended ? 39 : 19, i, len = number(&bits[base - 4], 4);

    r->is_complete = true;
    r->end = end;
    r->is_crc_right = divide(bits, total - 15)
        == number(&bits[total - 15], 15);
    r->frame.id = number(&bits[1], 11);
    if (extended)
        r->frame.id = r->frame.id << 18 | number(&bits[14], 18) | 1u << 31;
    if (bits[extended ? 32 : 12])
        r->frame.id |= 1u << 30;
    r->frame.len = len < 8 ? len : 8;
    for (i = 0; i < (total - base - 15) / 8; i++)
        r->frame.data[i] = (uint8_t)number(&bits[base + 8 * i], 8);
}

static struct reading
read_raw(const uint8_t *raw, uint32_t n)
{
    struct reading r = { 0 };
    uint8_t bits[MAX_RAW];
    uint32_t i, nb = 0, run = 0, total = UINT32_MAX;

    for (i = 0; i < n; i++) {
        bool equal = i && raw[i] == raw[i - 1];

        if (run == 5) {
            if (equal) {
                r.is_stuffed_wrong = true;
                return r;
            }
            run = 1;
        } else {
            run = equal ? run + 1 : 1;
            bits[nb++] = raw[i];
            total = find_total(bits, nb);
        }
        if (nb == total && run < 5) {
            finish(&r, bits, total, i + 1);
            return r;
        }
    }
    return r;
}

/*
 * The protocol
 */

static void
fail(struct node *node)
{
    node->n_errors++;
    if (node->is_sender && node->queue[node->got % N_QUEUE].flip >= 0) {
        node->got++;            /* it was wrong on purpose */
        node->n_dropped++;
    }
    node->is_sender = false;
    node->state = FLAG;
    node->count = 6;
    node->next_drive = 0;
}

static void
overload(struct node *node)
{
    node->n_overloads++;
    node->is_sender = false;
    node->state = FLAG;
    node->count = 6;
    node->next_drive = 0;
}

static void
rest(struct node *node)
{
    node->state = RESTING;
    node->is_sender = false;
    node->n_raw = 0;
    if (node->got == node->put)
        return;
    compose(node, &node->queue[node->got % N_QUEUE]);
    node->is_sender = true;
    node->next_drive = 0;
}

static void
note_received(struct node *node, const struct reading *r)
{
    node->received[node->n_received++ % N_QUEUE] = r->frame;
}

static void
sample_end(struct node *node, bool level, const struct reading *r)
{
    uint32_t k = node->n_raw - r->end;

    node->next_drive = 1;
    if (k == 2) {
        if (node->is_sender && level) {
            node->n_no_ack++;
            fail(node);
        }
        return;
    }
    if (k && !level && (k < 10 || node->is_sender)) {
        fail(node);
        return;
    }
    if (k == 1 && !node->is_sender && r->is_crc_right && !node->is_mute)
        node->next_drive = 0;
    if (k == 3 && !r->is_crc_right && !node->is_sender)
        fail(node);
    if (k == 9 && !node->is_sender)
        note_received(node, r);
    if (k < 10)
        return;
    if (!level) {
        overload(node);
        return;
    }
    if (node->is_sender) {
        node->got++;
        node->n_sent++;
    }
    node->state = PAUSE;
    node->count = 3;
}

static void
sample_frame(struct node *node, bool level)
{
    struct reading r;

    if (node->n_raw == MAX_RAW) {
        fail(node);
        return;
    }
    node->raw[node->n_raw++] = level;
    if (node->is_sender && node->n_raw <= node->n_bits
        && node->bits[node->n_raw - 1] != level) {
        if (!level && node->n_raw <= node->arbitration_end) {
            node->is_sender = false;
            node->n_lost++;
        } else {
            fail(node);
            return;
        }
    }
    r = read_raw(node->raw, node->n_raw);
    if (r.is_stuffed_wrong) {
        fail(node);
        return;
    }
    if (r.is_complete)
        sample_end(node, level, &r);
    else
        node->next_drive = node->is_sender && node->n_raw < node->n_bits
            ? node->bits[node->n_raw] : 1;
}

static void
sample(struct node *node, bool level)
{
    node->next_drive = 1;
    switch (node->state) {
    case LISTENING:
        node->count = level ? node->count + 1 : 0;
        if (node->count == 11)
            rest(node);
        return;
    case RESTING:
        if (level && node->is_sender) {
            fail(node);
        } else if (level) {
            rest(node);
        } else {
            node->state = FRAME;
            sample_frame(node, level);
        }
        return;
    case FRAME:
        sample_frame(node, level);
        return;
    case FLAG:
        node->next_drive = --node->count == 0;
        if (!node->count)
            node->state = OTHERS_FLAG;
        return;
    case OTHERS_FLAG:
        if (level) {
            node->state = DELIMITER;
            node->count = 7;
        }
        return;
    case DELIMITER:
        node->count--;
        if (!level && node->count)
            fail(node);
        else if (!level)
            overload(node);
        else if (!node->count) {
            node->state = PAUSE;
            node->count = 3;
        }
        return;
    case PAUSE:
        node->count--;
        if (!level && node->count) {
            overload(node);
        } else if (!level) {
            rest(node);
            node->is_sender = false;
            node->next_drive = 1;
            node->state = FRAME;
            sample_frame(node, level);
        } else if (!node->count) {
            rest(node);
        }
        return;
    }
}

/*
 * Bit timing
 */

static void
begin_bit(struct node *node, double now)
{
    node->phase = 0;
    node->drive = node->next_drive;
    node->show_at = now + (node->jitter
                           ? (double)((uint32_t)rand() % node->jitter) : 0);
}

static void
run_quantum(struct node *node, bool level)
{
    bool is_edge = node->last_level && !level && node->last_sample;

    node->last_level = level;
    if (++node->phase == QUANTA)
        begin_bit(node, node->due);
    if (is_edge) {
        if (node->state == RESTING && !node->is_sender) {
            node->phase = 0;
        } else if (node->phase < SAMPLE) {
            if (node->drive && node->phase)
                node->phase -= node->phase < JUMP ? node->phase : JUMP;
        } else if (QUANTA - node->phase <= JUMP) {
            begin_bit(node, node->due);
        } else {
            node->phase += JUMP;
        }
    }
    if (node->phase == SAMPLE) {
        node->last_sample = level;
        sample(node, level);
    }
}

static bool
bus_level(bool tx)
{
    bool level = tx && !wire.is_shorted;
    uint32_t i;

    for (i = 0; i < wire.n_nodes; i++)
        level = level && wire.nodes[i].shown;
    return level;
}

bool
wire_step(bool tx)
{
    uint64_t now = wire.cycle++;
    uint32_t i;
    bool level;

    wire.history[0][now % HISTORY] = tx;
    if (wire.is_open)
        return true;
    level = bus_level(wire.history[0][(now - wire.delay) % HISTORY]);
    wire.n_dominant += !level;
    wire.history[1][now % HISTORY] = level;
    for (i = 0; i < wire.n_nodes; i++) {
        struct node *node = &wire.nodes[i];

        while (node->due <= (double)now) {
            run_quantum(node, level);
            node->due += node->quantum;
        }
        if (node->show_at <= (double)now)
            node->shown = node->drive;
    }
    return wire.history[1][(now - wire.delay) % HISTORY];
}

bool
wire_is_quiet(void)
{
    uint32_t i;

    if (wire.is_shorted)
        return false;
    for (i = 0; i < wire.n_nodes; i++) {
        const struct node *node = &wire.nodes[i];

        if (node->state != RESTING || node->is_sender || !node->shown
            || !node->drive || !node->next_drive || node->got != node->put)
            return false;
    }
    for (i = 0; i < HISTORY; i++)
        if (!wire.history[0][i] || !wire.history[1][i])
            return false;
    return true;
}

void
wire_skip(uint64_t cycles)
{
    uint32_t i;

    wire.cycle += cycles;
    for (i = 0; i < wire.n_nodes; i++) {
        struct node *node = &wire.nodes[i];

        if (node->due < (double)wire.cycle)
            node->due += node->quantum * (double)(uint64_t)(
                ((double)wire.cycle - node->due) / node->quantum + 1);
    }
}

bool
wire_exists(void)
{
    return wire.exists;
}

uint32_t
wire_rx_pin(void)
{
    return wire.rx_pin;
}

uint32_t
wire_tx_pin(void)
{
    return wire.tx_pin;
}

/*
 * For tests
 */

/* A new bus; transceivers take `delay` cycles each way. */
void
unicorn_wire_begin(uint32_t rx_pin, uint32_t tx_pin, uint32_t delay)
{
    memset(&wire, 0, sizeof(wire));
    memset(wire.history, 1, sizeof(wire.history));
    wire.exists = true;
    wire.rx_pin = rx_pin;
    wire.tx_pin = tx_pin;
    wire.delay = delay;
    wire.cycle = HISTORY;
    srand(7);
}

/* One more node; its clock is slow by `ppm`.  Returns its number. */
uint32_t
unicorn_wire_add(uint32_t bit_rate, int32_t ppm, uint32_t jitter, int is_mute)
{
    struct node *node = &wire.nodes[wire.n_nodes];

    node->quantum = (double)chip.core_hz / bit_rate / QUANTA
        * (1 + ppm * 1e-6);
    node->due = (double)wire.cycle;
    node->jitter = jitter;
    node->is_mute = is_mute;
    node->drive = node->next_drive = node->shown = true;
    node->last_sample = node->last_level = true;
    return wire.n_nodes++;
}

/* flip: the level of this number is wrong, and the frame is sent once; -1. */
void
unicorn_wire_send(uint32_t number_of, const struct can_frame *frame,
                  int32_t flip)
{
    struct node *node = &wire.nodes[number_of];

    node->queue[node->put++ % N_QUEUE] = (struct order){ *frame, flip };
    chip_wake_at(chip.cycle);
}

int
unicorn_wire_receive(uint32_t number_of, struct can_frame *frame)
{
    struct node *node = &wire.nodes[number_of];

    if (node->n_taken == node->n_received)
        return 0;
    *frame = node->received[node->n_taken++ % N_QUEUE];
    return 1;
}

/* errors, frames sent, arbitration lost, overloads, without acknowledge, wrong
 * ones dropped, waiting, cycles in which the bus was dominant */
void
unicorn_wire_read(uint32_t number_of, uint64_t *stats)
{
    const struct node *node = &wire.nodes[number_of];

    stats[0] = node->n_errors;
    stats[1] = node->n_sent;
    stats[2] = node->n_lost;
    stats[3] = node->n_overloads;
    stats[4] = node->n_no_ack;
    stats[5] = node->n_dropped;
    stats[6] = node->put - node->got;
    stats[7] = wire.n_dominant;
}

/* The bus is dominant for ever; the chip's transceiver is not connected. */
void
unicorn_wire_break(int is_shorted, int is_open)
{
    wire.is_shorted = is_shorted;
    wire.is_open = is_open;
    chip_wake_at(chip.cycle);
}

/* Levels of a frame, for a test of this model itself. */
uint32_t
unicorn_wire_compose(const struct can_frame *frame, uint8_t *levels)
{
    static struct node node;
    struct order order = { *frame, -1 };

    compose(&node, &order);
    memcpy(levels, node.bits, node.n_bits);
    return node.n_bits;
}
