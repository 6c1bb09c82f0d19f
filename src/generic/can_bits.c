/* SPDX-License-Identifier: GPL-3.0-or-later
 * CAN 2.0B bit by bit (Bosch, CAN specification 2.0, part B; ISO 11898-1).
 *
 * A state is a function that takes a sample and says, for both values of the
 * next one, what is sent after it.  So answers are never late, however long
 * they take to compute: a bit's time.
 */
#include <string.h>

#include "generic/can_bits.h"

enum { CRC_POLYNOMIAL = 0x4599, PASSIVE_AT = 128, WARN_AT = 96, OFF_AT = 256 };
enum { RX_COUNT = 16, TX_COUNT = 4 };
/* Bits of a frame with their stuffing, delimiter included: 118 that may get one
 * in four */
enum { MAX_BITS = 118 + 29 + 1 };

/* A bit to send.  Words are those for the bit that follows, while a node is
 * active, and while it is passive. */
#define BIT_LEVEL 1u
#define BIT_ACTIVE_SHIFT 1
#define BIT_PASSIVE_SHIFT 4
#define BIT_MAY_LOSE 0x80u
/* What is left to do: a level that belongs to a field is to be added to it; a
 * frame was received, or sent */
#define PENDING 2u
#define PENDING_FRAME 4u
#define PENDING_SENT 8u

struct tx_slot { uint8_t bits[MAX_BITS + 1]; }; /* 0 ends them */
/* The fields of a frame as they came */
struct rx_slot { uint32_t head, extension, len, is_remote, data[2]; };

static struct tx_slot tx_ring[TX_COUNT];
static volatile uint32_t tx_put, tx_got;
/* the slot behind those that wait is being filled */
static struct rx_slot rx_ring[RX_COUNT];
static volatile uint32_t rx_put, rx_got;
static volatile uint32_t filter_id = CAN_ID_ADMIN;

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

static volatile struct {
    uint32_t rx_error, tx_error, retries, rec, tec;
    bool is_off;
} counts;

static uint32_t take_stuffed(uint32_t level);
static uint32_t take_own_bit(uint32_t level);
static uint32_t take_pause(uint32_t level);

/*
 * Fault confinement
 */

static void update_level(void)
{
    bus.err_level = counts.tec >= PASSIVE_AT || counts.rec >= PASSIVE_AT;
    bus.word_shift = bus.err_level ? BIT_PASSIVE_SHIFT : BIT_ACTIVE_SHIFT;
}

static void note_bad(uint32_t points)
{
    if (bus.is_sender) {
        counts.tec += points;
    } else {
        counts.rec += points;
        if (counts.rec > 255)
            counts.rec = 255;
    }
}

static void note_sent(void)
{
    if (counts.tec)
        counts.tec--;
    update_level();
}

static void note_received(void)
{
    uint32_t rec = counts.rec;

    if (!rec)
        return;
    counts.rec = rec >= PASSIVE_AT ? PASSIVE_AT - 8 : rec - 1;
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
            if (counts.is_off) {
                counts.tec = counts.rec = 0;
                counts.is_off = false;
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
    bus.slot = &rx_ring[rx_put % RX_COUNT];
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
    if (tx_got == tx_put)
        return CAN_WORD_IDLE;
    bus.tx = tx_ring[tx_got % TX_COUNT].bits;
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
    bus.slot = &rx_ring[rx_put % RX_COUNT];
    bus.left = bus.is_sender && bus.err_level ? 11 : 3;
    bus.n_dominant = 2;
    bus.tx = NULL;
    return CAN_WORD(1, 0);
}

bool can_bits_start(uint32_t *word)
{
    if (!bus.is_idle || tx_got == tx_put)
        return false;
    bus.tx = tx_ring[tx_got % TX_COUNT].bits;
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
    if (counts.tec >= OFF_AT) {
        counts.is_off = true;
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
    if (counts.tec >= OFF_AT) {
        counts.is_off = true;
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
        counts.tx_error++;
        counts.retries++;
    } else {
        counts.rx_error++;
    }
    bus.is_good = is_harmless && !is_active;
    if (!bus.is_good)
        note_bad(bus.is_sender ? 8 : 1);
    if (counts.tec >= OFF_AT) {
        counts.is_off = true;
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
        || (!(head & 1) && (id == CAN_ID_ADMIN || id == filter_id));
}

static void deliver(void)
{
    uint32_t put = rx_put;

    note_received();
    if (!is_wanted(bus.slot->head))
        return;
    if (put - rx_got == RX_COUNT - 1) {
        counts.rx_error++;
        return;
    }
    __atomic_thread_fence(__ATOMIC_RELEASE);
    rx_put = put + 1;
    can_bits_tell();
}

static void finish_sending(void)
{
    note_sent();
    tx_got = tx_got + 1;
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

/*
 * The other core
 */

struct writer {
    uint8_t *next;
    uint32_t crc, last, run;
    uint8_t flags;
};

static void put_level(struct writer *w, uint32_t level)
{
    w->run = level == w->last ? w->run + 1 : 1;
    w->last = level;
    *w->next++ = (uint8_t)(level | w->flags);
}

static void put_bits(struct writer *w, uint32_t value, uint32_t count)
{
    while (count--) {
        uint32_t level = value >> count & 1;

        w->crc = ((w->crc << 1)
                  ^ ((w->crc >> 14 ^ level) & 1 ? CRC_POLYNOMIAL : 0)) & 0x7fff;
        put_level(w, level);
        if (w->run == 5)
            put_level(w, !level);
    }
}

/* Each bit gets the words that say what follows it: the next bit; or, if it
 * is read as another, an error, or nothing more. */
static void add_words(uint8_t *bits, uint8_t *end)
{
    for (; bits < end; bits++) {
        uint32_t level = *bits & BIT_LEVEL, is_last = bits + 1 == end;
        uint32_t next = is_last ? 1 : bits[1] & BIT_LEVEL;
        uint32_t may_lose = (*bits & BIT_MAY_LOSE) != 0, active, passive;

        active = level ? CAN_WORD(next, may_lose) : CAN_WORD(0, next);
        passive = level ? CAN_WORD(next, 1) : CAN_WORD(1, next);
        *bits = (uint8_t)(*bits | active << 1 | passive << 4);
    }
}

bool can_bits_send(const struct can_frame *frame)
{
    uint32_t put = tx_put, id = frame->id, i;
    bool is_remote = id & CAN_REMOTE;
    uint8_t *bits = tx_ring[put % TX_COUNT].bits;
    struct writer w = { .next = bits, .last = 2 };

    if (put - tx_got == TX_COUNT)
        return false;
    put_bits(&w, 0, 1);
    w.flags = BIT_MAY_LOSE;
    if (id & CAN_EXTENDED) {
        put_bits(&w, (id >> 18 & 0x7ff) << 2 | 3, 13);
        put_bits(&w, (id & 0x3ffff) << 1 | is_remote, 19);
        w.flags = 0;
        put_bits(&w, 0, 2);
    } else {
        put_bits(&w, (id & 0x7ff) << 1 | is_remote, 12);
        w.flags = 0;
        put_bits(&w, 0, 2);
    }
    put_bits(&w, frame->len, 4);
    for (i = 0; !is_remote && i < frame->len; i++)
        put_bits(&w, frame->data[i], 8);
    put_bits(&w, w.crc, 15);
    put_level(&w, 1);
    *w.next = 0;
    add_words(bits, w.next);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    tx_put = put + 1;
    return true;
}

/* Bytes came first bit first, and a word that is not full is at its end. */
static void read_bytes(uint8_t *to, uint32_t word, uint32_t count)
{
    while (count--) {
        to[count] = (uint8_t)word;
        word >>= 8;
    }
}

static void read_slot(const struct rx_slot *slot, struct can_frame *frame)
{
    uint32_t len = slot->len, first = len < 4 ? len : 4;

    frame->id = slot->head >> 2;
    if (slot->head & 1)
        frame->id = CAN_EXTENDED | frame->id << 18 | slot->extension >> 2;
    frame->len = (uint8_t)len;
    if (slot->is_remote) {
        frame->id |= CAN_REMOTE;
        return;
    }
    read_bytes(frame->data, slot->data[0], first);
    read_bytes(&frame->data[4], slot->data[1], len - first);
}

bool can_bits_receive(struct can_frame *frame)
{
    uint32_t got = rx_got;

    if (got == rx_put)
        return false;
    memset(frame, 0, sizeof(*frame));
    read_slot(&rx_ring[got % RX_COUNT], frame);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    rx_got = got + 1;
    return true;
}

void can_bits_set_filter(uint16_t id)
{
    filter_id = id;
}

void can_bits_read_status(struct can_status *status)
{
    uint32_t rec = counts.rec, tec = counts.tec;

    status->rx_error = counts.rx_error;
    status->tx_error = counts.tx_error;
    status->tx_retries = counts.retries;
    status->state = counts.is_off ? CAN_STATE_OFF
        : rec >= PASSIVE_AT || tec >= PASSIVE_AT ? CAN_STATE_PASSIVE
        : rec >= WARN_AT || tec >= WARN_AT ? CAN_STATE_WARN : CAN_STATE_ACTIVE;
}
