/* SPDX-License-Identifier: GPL-3.0-or-later
 * CAN 2.0B bit by bit (Bosch, CAN specification 2.0, part B; ISO 11898-1).
 *
 * A state is a function that takes a sample and says, for both values of the
 * next one, what is sent after it.  So answers are never late, however long
 * they take to compute: a bit's time.
 */
#include <stddef.h>

#include "generic/can_bits_rings.h"

/* What is left to do: a level that belongs to a field is to be added to it; a
 * frame was received, or sent */
#define PENDING 2u
#define PENDING_FRAME 4u
#define PENDING_SENT 8u

static struct {
    uint32_t (*take)(uint32_t level);
    /* of the frame: repeated levels, check sum, what is being collected */
    uint32_t last, run, crc, value, left, pending;
    void (*end_field)(void);    /* NULL: the check sum's */
    /* of sending: the bit that is on the bus, and those after it */
    const uint8_t *tx;
    uint32_t expected, word_shift;
    uint32_t err_level;         /* what tells others of an error */
    uint32_t n_dominant;
    bool is_overload, is_sender, has_dominant, is_good, is_idle;
    struct rx_slot *slot;
    uint32_t *data;
    uint32_t data_bits, n_field;
} bus;

volatile struct can_bits_counts can_bits__counts;

static uint32_t take_stuffed(uint32_t level);
static uint32_t take_own_bit(uint32_t level);
static uint32_t take_pause(uint32_t level);

/*
 * Fault confinement
 */

static void update_level(void)
{
    bus.err_level = can_bits__counts.tec >= PASSIVE_AT
        || can_bits__counts.rec >= PASSIVE_AT;
    bus.word_shift = bus.err_level ? BIT_PASSIVE_SHIFT : BIT_ACTIVE_SHIFT;
}

static void note_bad(uint32_t points)
{
    if (bus.is_sender) {
        can_bits__counts.tec += points;
    } else {
        can_bits__counts.rec += points;
        if (can_bits__counts.rec > 255)
            can_bits__counts.rec = 255;
    }
}

static void note_sent(void)
{
    if (can_bits__counts.tec)
        can_bits__counts.tec--;
    update_level();
}

static void note_received(void)
{
    uint32_t rec = can_bits__counts.rec;

    if (!rec)
        return;
    can_bits__counts.rec = rec >= PASSIVE_AT ? PASSIVE_AT - 8 : rec - 1;
    update_level();
}

/*
 * Between frames
 */

/* Eleven recessive bits, once or (off the bus) 128 times */
static uint32_t take_integration(uint32_t level)
{
    if (!level)
        bus.run = 0;
    else if (++bus.run == 11) {
        bus.run = 0;
        if (--bus.left == 0) {
            if (can_bits__counts.is_off) {
                can_bits__counts.tec = can_bits__counts.rec = 0;
                can_bits__counts.is_off = false;
                update_level();
            }
            bus.is_sender = false;
            bus.take = take_pause;
            bus.left = 1;
            bus.n_dominant = 0;
            return CAN_WORD_IDLE;
        }
    }
    return CAN_WORD_REST;
}

static uint32_t begin_integration(uint32_t times)
{
    bus.take = take_integration;
    bus.slot = &can_bits__rings.rx[can_bits__rings.rx_put % RX_COUNT];
    update_level();
    bus.is_idle = false;
    bus.run = 0;
    bus.left = times;
    bus.tx = NULL;
    return CAN_WORD_REST;
}

/* The word while the last bit of a pause, or of an idle bus, is waited for:
 * a frame of ours begins after it, or joins one that begins with it. */
static uint32_t prepare_start(void)
{
    if (can_bits__rings.tx_got == can_bits__rings.tx_put)
        return CAN_WORD_IDLE;
    bus.tx = can_bits__rings.tx[can_bits__rings.tx_got % TX_COUNT].bits;
    return CAN_WORD(0, bus.tx[1] & BIT_LEVEL);
}

static inline void collect(uint32_t bits, void (*end)(void))
{
    bus.left = bits;
    bus.value = 0;
    bus.end_field = end;
}

static uint32_t tx_word(void)
{
    return bus.expected >> bus.word_shift & 7;
}

static void end_head(void);

/* The dominant bit that begins a frame has come. */
static uint32_t begin_frame(void)
{
    bus.take = take_stuffed;
    bus.is_idle = false;
    bus.last = 0;
    bus.run = 1;
    bus.crc = 0;
    bus.is_sender = bus.tx != NULL;
    collect(13, end_head);
    if (!bus.tx)
        return CAN_WORD_REST;
    /* bits[0] was this one, whoever sent it */
    bus.expected = bus.tx[1];
    bus.tx += 2;
    return tx_word();
}

static uint32_t begin_overload(void);
static uint32_t begin_error(bool is_harmless);

/* The first bit of a frame that only we begin */
static uint32_t take_own_start(uint32_t level)
{
    if (!level)
        return begin_frame();
    bus.is_sender = true;
    return begin_error(false);
}

static uint32_t take_pause(uint32_t level)
{
    const uint8_t *tx;
    uint32_t left;

    if (!level && bus.is_idle)
        return begin_frame();
    left = --bus.left;
    tx = bus.tx;
    if (!level) {
        /* what overload frames may begin at: the first two bits */
        if (bus.n_dominant) {
            bus.n_dominant--;
            bus.tx = NULL;
            return begin_overload();
        }
        if (left)
            bus.tx = NULL;
        return begin_frame();
    }
    if (bus.n_dominant)
        bus.n_dominant--;
    if (left > 1)
        return bus.n_dominant ? CAN_WORD(1, 0) : CAN_WORD_REST;
    if (left == 1)
        return prepare_start();
    if (tx) {
        bus.take = take_own_start;
        bus.expected = tx[0];
        return tx_word();
    }
    /* idle: a dominant bit comes next, or none; a recessive one was a spike */
    bus.left = 1;
    bus.is_idle = !bus.is_idle;
    return bus.is_idle ? CAN_WORD_REST : prepare_start();
}

/* Three bits; a passive sender gives others eight more. */
static uint32_t begin_pause(void)
{
    update_level();
    bus.take = take_pause;
    bus.slot = &can_bits__rings.rx[can_bits__rings.rx_put % RX_COUNT];
    bus.left = bus.is_sender && bus.err_level ? 11 : 3;
    bus.n_dominant = 2;
    bus.tx = NULL;
    return CAN_WORD(1, 0);
}

bool can_bits_start(uint32_t *word)
{
    if (!bus.is_idle || can_bits__rings.tx_got == can_bits__rings.tx_put)
        return false;
    bus.tx = can_bits__rings.tx[can_bits__rings.tx_got % TX_COUNT].bits;
    bus.take = take_own_start;
    bus.is_idle = false;
    bus.expected = bus.tx[0];
    *word = tx_word();
    return true;
}

/*
 * Errors and overload
 */

/* Seven recessive bits after the first one */
static uint32_t take_delimiter(uint32_t level)
{
    uint32_t left = --bus.left;

    if (!level)
        return left ? begin_error(false) : begin_overload();
    if (!left)
        return begin_pause();
    return CAN_WORD(1, left == 1 ? 0 : bus.err_level);
}

/* Others may still tell of the error. */
static uint32_t take_superposition(uint32_t level)
{
    if (level) {
        bus.take = take_delimiter;
        bus.left = 7;
        return CAN_WORD(1, bus.err_level);
    }
    bus.n_dominant++;
    if (bus.n_dominant % 8 == 0
        || (bus.n_dominant == 1 && !bus.is_sender && !bus.is_overload))
        note_bad(8);
    if (can_bits__counts.tec >= OFF_AT) {
        can_bits__counts.is_off = true;
        return begin_integration(128);
    }
    return CAN_WORD_REST;
}

static uint32_t end_flag(void)
{
    bus.take = take_superposition;
    bus.n_dominant = 0;
    update_level();
    return CAN_WORD_REST;
}

static uint32_t take_active_flag(uint32_t level)
{
    if (level)
        note_bad(8);
    if (can_bits__counts.tec >= OFF_AT) {
        can_bits__counts.is_off = true;
        return begin_integration(128);
    }
    if (--bus.left == 0)
        return end_flag();
    return bus.left >= 2 ? CAN_WORD(0, 0) : CAN_WORD_REST;
}

/* Six equal bits, whoever sends them */
static uint32_t take_passive_flag(uint32_t level)
{
    if (!level && bus.is_good && !bus.has_dominant) {
        /* it was no acknowledge, but somebody is there */
        bus.has_dominant = true;
        note_bad(8);
    }
    if (level == bus.last)
        bus.run++;
    else
        bus.run = 1;
    bus.last = level;
    return bus.run == 6 ? end_flag() : CAN_WORD_REST;
}

static uint32_t begin_flag(bool is_active)
{
    bus.tx = NULL;
    if (is_active) {
        bus.take = take_active_flag;
        bus.left = 6;
        return CAN_WORD(0, 0);
    }
    bus.take = take_passive_flag;
    bus.last = 2;
    bus.run = 0;
    bus.has_dominant = false;
    return CAN_WORD_REST;
}

static uint32_t begin_overload(void)
{
    bus.is_overload = true;
    return begin_flag(true);
}

/* is_harmless: a passive sender that nobody acknowledges stays on the bus. */
static uint32_t begin_error(bool is_harmless)
{
    bool is_active = !bus.err_level;

    bus.is_overload = false;
    if (bus.is_sender) {
        can_bits__counts.tx_error++;
        can_bits__counts.retries++;
    } else {
        can_bits__counts.rx_error++;
    }
    bus.is_good = is_harmless && !is_active;
    if (!bus.is_good)
        note_bad(bus.is_sender ? 8 : 1);
    if (can_bits__counts.tec >= OFF_AT) {
        can_bits__counts.is_off = true;
        return begin_integration(128);
    }
    return begin_flag(is_active);
}

/*
 * The end of a frame: no stuffing
 */

static bool is_wanted(uint32_t head)
{
    uint32_t id = head >> 2;

    return CONFIG_USBCANBUS
        || (!(head & 1)
            && (id == CAN_ID_ADMIN || id == can_bits__rings.filter_id));
}

static void deliver(void)
{
    uint32_t put = can_bits__rings.rx_put;

    note_received();
    if (!is_wanted(bus.slot->head))
        return;
    if (put - can_bits__rings.rx_got == RX_COUNT - 1) {
        can_bits__counts.rx_error++;
        return;
    }
    __atomic_thread_fence(__ATOMIC_RELEASE);
    can_bits__rings.rx_put = put + 1;
    can_bits_tell();
}

static void finish_sending(void)
{
    note_sent();
    can_bits__rings.tx_got = can_bits__rings.tx_got + 1;
    can_bits_tell();
}

static uint32_t take_end(uint32_t level)
{
    uint32_t left = --bus.left;

    if (!level)
        return left || bus.is_sender ? begin_error(false) : begin_overload();
    if (left == 1) {
        if (!bus.is_sender)
            bus.pending = PENDING_FRAME;
        return CAN_WORD(1, bus.is_sender ? bus.err_level : 0);
    }
    if (left)
        return CAN_WORD(1, bus.err_level);
    if (bus.is_sender)
        bus.pending = PENDING_SENT;
    return begin_pause();
}

static uint32_t take_ack_delimiter(uint32_t level)
{
    if (!level || bus.crc)
        return begin_error(false);
    bus.take = take_end;
    bus.left = 7;
    return CAN_WORD(1, bus.err_level);
}

static uint32_t take_ack(uint32_t level)
{
    if (level && bus.is_sender)
        return begin_error(true);
    bus.take = take_ack_delimiter;
    return CAN_WORD(bus.crc ? bus.err_level : 1, bus.err_level);
}

static uint32_t take_crc_delimiter(uint32_t level)
{
    if (!level)
        return begin_error(false);
    bus.take = take_ack;
    bus.tx = NULL;
    return bus.is_sender ? CAN_WORD(bus.err_level, 1) : CAN_WORD_REST;
}

/* The word says whether we acknowledge. */
static uint32_t expect_crc_delimiter(void)
{
    bus.take = take_crc_delimiter;
    return CAN_WORD(bus.is_sender || bus.crc, bus.err_level);
}

/* Five equal bits at the end of the check sum are followed by another. */
static uint32_t take_last_stuff(uint32_t level)
{
    if (level == bus.last)
        return begin_error(false);
    return expect_crc_delimiter();
}

static uint32_t begin_end(void)
{
    uint32_t last = bus.last;

    if (bus.run < 5)
        return expect_crc_delimiter();
    bus.take = take_last_stuff;
    return CAN_WORD(last ? bus.err_level : 1, last ? 1 : bus.err_level);
}

/*
 * The fields with stuffing: bus.value has the bits of one
 */

static void end_data(void)
{
    *bus.data++ = bus.value;
    if (bus.data_bits -= bus.n_field)
        collect(bus.n_field = bus.data_bits, end_data);
    else
        collect(15, NULL);
}

/* A reserved bit and the length; data in two words */
static void end_length(void)
{
    uint32_t len = bus.value & 15;

    if (len > 8)
        len = 8;
    bus.slot->len = len;
    if (bus.slot->is_remote || !len) {
        collect(15, NULL);
        return;
    }
    bus.data = bus.slot->data;
    bus.data_bits = 8 * len;
    bus.n_field = len > 4 ? 32 : 8 * len;
    collect(bus.n_field, end_data);
}

/* The other 18 bits of an id, remote, a reserved bit */
static void end_extension(void)
{
    bus.slot->extension = bus.value;
    bus.slot->is_remote = bus.value & 2;
    collect(5, end_length);
}

/* 11 bits of id, remote, extended */
static void end_head(void)
{
    struct rx_slot *slot = bus.slot;
    uint32_t head = bus.value;

    slot->head = head;
    slot->is_remote = head & 2;
    bus.value = 0;
    bus.left = head & 1 ? 20 : 5;
    bus.end_field = head & 1 ? end_extension : end_length;
}

/* Nothing more of ours: another's frame goes before it. */
static bool is_lost(uint32_t expected)
{
    const uint32_t both = BIT_MAY_LOSE | BIT_LEVEL;

    if ((expected & both) != both)
        return false;
    bus.tx = NULL;
    bus.is_sender = false;
    return true;
}

/* Compare with what we send; false: an error.  *word says what comes next. */
static inline bool check_sent(uint32_t level, uint32_t *word)
{
    uint32_t expected = bus.expected;

    if ((expected ^ level) & BIT_LEVEL)
        return is_lost(expected);
    bus.expected = expected = *bus.tx++;
    *word = expected >> bus.word_shift & 7;
    if (!(expected & BIT_MAY_LOSE))
        bus.take = take_own_bit;
    return true;
}

/* The bits after those that decide whose frame it is: as they are compared,
 * neither stuffing nor fields need be looked at. */
static uint32_t take_own_bit(uint32_t level)
{
    uint32_t expected = bus.expected;
    const uint8_t *tx = bus.tx;

    if ((expected ^ level) & BIT_LEVEL)
        return begin_error(false);
    bus.expected = expected = *tx++;
    bus.tx = tx;
    if (!*tx) {
        bus.crc = 0;
        return expect_crc_delimiter();
    }
    return expected >> bus.word_shift & 7;
}

/* After five equal bits a sixth is an error. */
static inline uint32_t take_stuffed_bit(uint32_t level)
{
    uint32_t word = CAN_WORD_REST, run = bus.run;

    if (bus.tx && !check_sent(level, &word))
        return begin_error(false);
    if (level != bus.last) {
        bus.last = level;
        bus.run = 1;
        if (run == 5)
            return word;
        bus.pending = level | PENDING;
    } else {
        bus.run = ++run;
        bus.pending = level | PENDING;
        if (run == 5)
            word &= bus.err_level ? CAN_WORD_REST
                : level ? CAN_WORD(0, 1) : CAN_WORD(1, 0);
        else if (run == 6) {
            bus.pending = 0;
            return begin_error(false);
        }
    }
    if (bus.left == 1 && !bus.end_field) {
        /* the check sum with its last bit is 0, if all is right */
        bus.crc ^= level << 14;
        bus.pending = 0;
        return begin_end();
    }
    return word;
}

static uint32_t take_stuffed(uint32_t level)
{
    return take_stuffed_bit(level);
}

/* The same without a call through a pointer: most bits are of this kind. */
uint32_t can_bits_take(uint32_t level)
{
    if (bus.take == take_stuffed)
        return take_stuffed_bit(level);
    if (!bus.take)
        begin_integration(1);
    return bus.take(level);
}

static void settle_frame(uint32_t what)
{
    if (what == PENDING_FRAME)
        deliver();
    else
        finish_sending();
}

bool can_bits_settle(void)
{
    uint32_t level = bus.pending, crc = bus.crc;

    if (!level)
        return bus.is_idle;
    bus.pending = 0;
    if (level >= PENDING_FRAME) {
        settle_frame(level);
        return false;
    }
    level &= BIT_LEVEL;
    crc = (crc << 1) ^ ((crc >> 14 ^ level) & 1 ? CRC_POLYNOMIAL : 0);
    bus.crc = crc & 0x7fff;
    bus.value = bus.value << 1 | level;
    if (--bus.left == 0 && bus.end_field)
        bus.end_field();
    return false;
}
