/* SPDX-License-Identifier: GPL-3.0-or-later
 * Receiving half of the reliable link.  See sqcore.h. */
#include <string.h>

#include "sqcore.h"
#include "sqcore_internal.h"

/* Take the mcu's word for the sequence; numbers stay above what was sent. */
static void
note_sync(struct sqcore *c, uint8_t seq4)
{
    uint64_t seq = c->send_seq + ((seq4 - c->send_seq) & MSGBLOCK_SEQ_MASK);

    c->send_seq = c->receive_seq = c->ack_seq = seq;
    c->n_stale = c->n_unanswered = (uint32_t)c->n_probes - 1;
    c->is_synced = 1;
    rto_init(&c->rto);
}

/* Completions of an acknowledged block go to the inbox. */
static void
note_acked_block(struct sqcore *c, struct sqblock *b, double time)
{
    struct qmsg *m;

    while ((m = qfifo_pop(&b->waited)) != NULL) {
        m->len = 0;
        m->sent_time = b->sent_time;
        m->receive_time = time;
        qfifo_push(&c->inbox, m);
    }
    c->unacked_bytes -= b->len;
    c->acked_sent_time = b->is_resent ? 0. : b->sent_time;
}

static void
note_acked(struct sqcore *c, uint64_t seq, double now, double time)
{
    const struct sqblock *last = &c->ring[(seq - 1) % SQCORE_RING];

    if (!last->is_resent) {
        rto_note_sample(&c->rto, now - last->time);
        c->n_stale = 0;
        c->n_unanswered = (uint32_t)(c->send_seq - seq) + 1;
    } else {
        rto_note_progress(&c->rto);
    }
    while (c->receive_seq < seq)
        note_acked_block(c, &c->ring[c->receive_seq++ % SQCORE_RING], time);
    sqcore__set_deadline(c, now);
}

/* An empty block is the answer to one of ours.  The first with a number is
 * its acknowledgement (a response may have brought the number before).  Another
 * one says that the mcu got something else than what it waits for.  When all
 * was sent again, the answers to what was on the way before say nothing new. */
static void
note_answer(struct sqcore *c, double now)
{
    int is_stale = c->n_stale > 0;

    c->n_stale -= c->n_stale > 0;
    c->n_unanswered -= c->n_unanswered > 0;
    if (c->ack_seq < c->receive_seq)
        c->ack_seq = c->receive_seq;
    else if (!is_stale && c->send_seq != c->receive_seq)
        sqcore__resend(c, now);
}

static void
deliver(struct sqcore *c, const uint8_t *payload, size_t len, double time)
{
    struct qmsg *m = qmsg_new();

    if (m) {
        m->len = (uint8_t)len;
        memcpy(m->data, payload, len);
    } else {
        m = c->spare;
        c->spare = NULL;
        if (!m)
            return;             /* they have been told */
    }
    m->sent_time = c->acked_sent_time;
    m->receive_time = time;
    qfifo_push(&c->inbox, m);
}

static void
note_sequence(struct sqcore *c, uint8_t seq4, int is_empty, double now,
              double time)
{
    uint64_t ahead = (seq4 - c->receive_seq) & MSGBLOCK_SEQ_MASK;

    if (!c->is_synced) {
        if (is_empty && c->n_probes)
            note_sync(c, seq4);
        return;
    }
    if (ahead > c->send_seq - c->receive_seq)
        return;
    if (ahead)
        note_acked(c, c->receive_seq + ahead, now, time);
    if (is_empty)
        note_answer(c, now);
}

static void
note_block(struct sqcore *c, double now, const uint8_t *block, size_t len)
{
    double time = now - (double)len * c->byte_time;

    sqhistory_note(&c->received, now, block, len);
    note_sequence(c, block[1] & MSGBLOCK_SEQ_MASK, len == MSGBLOCK_MIN, now,
                  time);
    if (len > MSGBLOCK_MIN)
        deliver(c, block + MSGBLOCK_HEADER, len - MSGBLOCK_MIN, time);
}

static void
parse_input(struct sqcore *c, double now)
{
    size_t pos = 0;

    for (;;) {
        int found = msgblock_check(c->in + pos, c->in_len - pos);
        if (!found)
            break;
        if (found > 0) {
            note_block(c, now, c->in + pos, (size_t)found);
            pos += (size_t)found;
            continue;
        }
        pos += (size_t)-found;
        if (found != -1 || c->in[pos - 1] != MSGBLOCK_SYNC)
            c->bytes_invalid += (size_t)-found;
    }
    c->in_len -= (uint32_t)pos;
    memmove(c->in, c->in + pos, c->in_len);
}

void
sqcore_input(struct sqcore *c, double now, const uint8_t *buf, size_t len)
{
    c->bytes_read += len;
    while (len) {
        size_t count = sizeof(c->in) - c->in_len;
        if (count > len)
            count = len;
        memcpy(c->in + c->in_len, buf, count);
        c->in_len += (uint32_t)count;
        buf += count;
        len -= count;
        parse_input(c, now);
    }
}
