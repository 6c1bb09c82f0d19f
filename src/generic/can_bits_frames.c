/* SPDX-License-Identifier: GPL-3.0-or-later
 * Frames of can_bits.h on the core where they come from and go to: turned into
 * the bits to send, with their words, and out of the fields that came.
 */
#include <string.h>

#include "generic/can_bits_rings.h"

struct can_bits_rings can_bits__rings = { .filter_id = CAN_ID_ADMIN };

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
    uint32_t put = can_bits__rings.tx_put, id = frame->id, i;
    bool is_remote = id & CAN_REMOTE;
    uint8_t *bits = can_bits__rings.tx[put % TX_COUNT].bits;
    struct writer w = { .next = bits, .last = 2 };

    if (put - can_bits__rings.tx_got == TX_COUNT)
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
    can_bits__rings.tx_put = put + 1;
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
    uint32_t got = can_bits__rings.rx_got;

    if (got == can_bits__rings.rx_put)
        return false;
    memset(frame, 0, sizeof(*frame));
    read_slot(&can_bits__rings.rx[got % RX_COUNT], frame);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    can_bits__rings.rx_got = got + 1;
    return true;
}

void can_bits_set_filter(uint16_t id)
{
    can_bits__rings.filter_id = id;
}

void can_bits_read_status(struct can_status *status)
{
    uint32_t rec = can_bits__counts.rec, tec = can_bits__counts.tec;

    status->rx_error = can_bits__counts.rx_error;
    status->tx_error = can_bits__counts.tx_error;
    status->tx_retries = can_bits__counts.retries;
    status->state = can_bits__counts.is_off ? CAN_STATE_OFF
        : rec >= PASSIVE_AT || tec >= PASSIVE_AT ? CAN_STATE_PASSIVE
        : rec >= WARN_AT || tec >= WARN_AT ? CAN_STATE_WARN : CAN_STATE_ACTIVE;
}
