/* SPDX-License-Identifier: GPL-3.0-or-later
 * Sending half of the reliable link, and time.  See sqcore.h. */
#include <errno.h>
#include <math.h>
#include <string.h>

#include "sqcore.h"
#include "sqcore_internal.h"

/* A message may leave this long before it is required; earlier only as part
 * of a full block. */
#define SEND_AHEAD 0.250
/* Shortest wait: keeps rounding from waking the driver over and over. */
#define WAKE_STEP 1e-6

int
sqcore_init(struct sqcore *c)
{
    memset(c, 0, sizeof(*c));
    c->spare = qmsg_new();
    if (!c->spare)
        return -ENOMEM;
    cmdsched_init(&c->sched);
    rto_init(&c->rto);
    c->send_seq = c->receive_seq = 1;
    return 0;
}

void
sqcore_free(struct sqcore *c)
{
    cmdsched_free(&c->sched);
    for (int i = 0; i < SQCORE_RING; i++)
        qfifo_clear(&c->ring[i].waited);
    qfifo_clear(&c->inbox);
    qmsg_free(c->spare);
    c->spare = NULL;
}

void
sqhistory_note(struct sqhistory *h, double time, const uint8_t *data,
               size_t len)
{
    struct sqrecord *r = &h->records[h->count++ % SQCORE_HISTORY];

    r->time = time;
    r->len = (uint8_t)len;
    memcpy(r->data, data, len);
}

/* Hand bytes to the driver; returns when the last is on the wire. */
static double
emit(struct sqcore *c, double now, const uint8_t *buf, size_t len)
{
    memcpy(c->out + c->out_len, buf, len);
    c->out_len += (uint32_t)len;
    c->bytes_write += len;
    c->wire_idle = fmax(c->wire_idle, now) + (double)len * c->byte_time;
    return c->wire_idle;
}

static size_t
get_out_room(const struct sqcore *c)
{
    return SQCORE_OUT_SIZE - c->out_len;
}

static uint64_t
count_in_flight(const struct sqcore *c)
{
    return c->send_seq - c->receive_seq;
}

void
sqcore__set_deadline(struct sqcore *c, double now)
{
    c->deadline = fmax(now, c->wire_idle) + c->rto.timeout;
}

/* Ask the mcu which sequence number it expects. */
static void
send_probe(struct sqcore *c, double now)
{
    uint8_t block[MSGBLOCK_MAX];
    size_t len = msgblock_build(block, (uint8_t)c->send_seq, NULL, 0);

    if (get_out_room(c) > len)
        emit(c, now, block, len);
    if (c->n_probes++)
        rto_backoff(&c->rto);
    sqcore__set_deadline(c, now);
}

void
sqcore__resend(struct sqcore *c, double now)
{
    uint8_t sync = MSGBLOCK_SYNC;

    if (get_out_room(c) < c->unacked_bytes + 1) {
        sqcore__set_deadline(c, now);
        return;
    }
    emit(c, now, &sync, 1);
    for (uint64_t seq = c->receive_seq; seq < c->send_seq; seq++) {
        struct sqblock *b = &c->ring[seq % SQCORE_RING];
        b->is_resent = 1;
        b->sent_time = emit(c, now, b->data, b->len);
    }
    c->bytes_retransmit += c->unacked_bytes;
    c->retransmit_seq = c->send_seq;
    c->n_stale = c->n_unanswered;
    c->n_unanswered += (uint32_t)count_in_flight(c);
    sqcore__set_deadline(c, now);
}

static void
check_deadline(struct sqcore *c, double now)
{
    if (!count_in_flight(c) || now < c->deadline)
        return;
    rto_backoff(&c->rto);
    sqcore__resend(c, now);
}

static void
send_block(struct sqcore *c, double now, uint32_t room)
{
    struct sqblock *b = &c->ring[c->send_seq % SQCORE_RING];
    uint8_t *payload = b->data + MSGBLOCK_HEADER;
    uint32_t used = cmdsched_fill(&c->sched, payload, room, &b->waited);

    b->len = (uint8_t)msgblock_build(b->data, (uint8_t)c->send_seq, payload,
                                     used);
    b->is_resent = 0;
    b->time = now;
    b->sent_time = emit(c, now, b->data, b->len);
    if (!count_in_flight(c))
        sqcore__set_deadline(c, now);
    c->send_seq++;
    c->n_unanswered++;
    c->unacked_bytes += b->len;
    sqhistory_note(&c->sent, now, b->data, b->len);
}

/* Payload bytes that the window leaves for the next block, 0 to wait. */
static uint32_t
calc_room(const struct sqcore *c)
{
    uint32_t want = c->sched.ready_bytes, room;

    if (want > MSGBLOCK_PAYLOAD_MAX)
        want = MSGBLOCK_PAYLOAD_MAX;
    if (!c->receive_window || !c->unacked_bytes)
        return MSGBLOCK_PAYLOAD_MAX;
    if (c->unacked_bytes + MSGBLOCK_MIN + want > c->receive_window)
        return 0;
    room = c->receive_window - c->unacked_bytes - MSGBLOCK_MIN;
    return room < MSGBLOCK_PAYLOAD_MAX ? room : MSGBLOCK_PAYLOAD_MAX;
}

/* When the ready messages should leave: at once on an idle link, so that the
 * mcu has all that it can hold; infinity: when the link is idle. */
static double
calc_send_time(const struct sqcore *c)
{
    uint64_t urgent = cmdsched_get_urgent(&c->sched);

    if (!count_in_flight(c))
        return 0.;
    if (urgent >= QMSG_BACKGROUND_CLOCK)
        return INFINITY;
    if (c->sched.ready_bytes >= MSGBLOCK_PAYLOAD_MAX
        || !clockest_is_known(&c->clockest))
        return 0.;
    return clockest_time_at(&c->clockest, urgent) - SEND_AHEAD;
}

static double
calc_release_time(const struct sqcore *c)
{
    if (c->sched.next_release == UINT64_MAX
        || !clockest_is_known(&c->clockest))
        return INFINITY;
    return clockest_time_at(&c->clockest, c->sched.next_release);
}

/* Send all blocks that may go now.  Returns when to look again. */
static double
send_due(struct sqcore *c, double now)
{
    double block_time = MSGBLOCK_MAX * c->byte_time, start;
    uint32_t room;

    while (c->sched.ready_bytes) {
        start = fmax(calc_send_time(c), c->wire_idle - block_time);
        if (start > now)
            return start;
        room = calc_room(c);
        if (!room || count_in_flight(c) >= SQCORE_IN_FLIGHT
            || get_out_room(c) < MSGBLOCK_MAX)
            return INFINITY;
        send_block(c, now, room);
    }
    return INFINITY;
}

static double
run_unsynced(struct sqcore *c, double now)
{
    if (!c->sched.ready_bytes)
        return calc_release_time(c);
    if (!c->n_probes || now >= c->deadline)
        send_probe(c, now);
    return c->deadline;
}

double
sqcore_run(struct sqcore *c, double now)
{
    double wake;

    cmdsched_release(&c->sched, clockest_is_known(&c->clockest)
                     ? clockest_clock_at(&c->clockest, now) : UINT64_MAX - 1);
    if (!c->is_synced) {
        wake = run_unsynced(c, now);
    } else {
        check_deadline(c, now);
        wake = fmin(send_due(c, now), calc_release_time(c));
        if (count_in_flight(c))
            wake = fmin(wake, c->deadline);
    }
    return fmax(wake, now + WAKE_STEP);
}

void
sqcore_get_stats(const struct sqcore *c, struct sqstats *stats)
{
    *stats = (struct sqstats) {
        .bytes_write = c->bytes_write, .bytes_read = c->bytes_read,
        .bytes_retransmit = c->bytes_retransmit,
        .bytes_invalid = c->bytes_invalid,
        .send_seq = c->send_seq, .receive_seq = c->receive_seq,
        .retransmit_seq = c->retransmit_seq,
        .srtt = c->rto.srtt, .rttvar = c->rto.rttvar, .rto = c->rto.timeout,
        .freq = c->clockest.freq, .ready_bytes = c->sched.ready_bytes,
        .upcoming_bytes = c->sched.upcoming_bytes,
    };
}

int
sqcore_check(const struct sqcore *c)
{
    uint32_t unacked = 0;

    for (uint64_t seq = c->receive_seq; seq < c->send_seq; seq++)
        unacked += c->ring[seq % SQCORE_RING].len;
    if (unacked != c->unacked_bytes)
        return -10;
    if (count_in_flight(c) > SQCORE_IN_FLIGHT)
        return -11;
    if (c->out_len > SQCORE_OUT_SIZE || c->in_len > SQCORE_IN_SIZE)
        return -12;
    if (clockest_check(&c->clockest))
        return clockest_check(&c->clockest);
    if (rto_check(&c->rto))
        return rto_check(&c->rto);
    if (qfifo_check(&c->inbox))
        return qfifo_check(&c->inbox);
    return cmdsched_check(&c->sched);
}
