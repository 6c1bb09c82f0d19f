/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * The reliable link to one mcu as a state machine without I/O.
 *
 * Events go in by sqcore_input() (bytes arrived) and sqcore_run() (time
 * passed, or messages were queued); bytes to write come out in `out`, received
 * messages and completions in `inbox`.  The driver writes, waits and locks.
 *
 * Blocks sent but not acknowledged have the sequence numbers receive_seq up to
 * send_seq - 1 and lie in `ring`; there are at most SQCORE_IN_FLIGHT, so four
 * bits on the wire are unambiguous.  Until the first acknowledgement nothing
 * is known of the mcu's sequence: an empty block is sent to ask for it.
 */
#ifndef SQCORE_H
#define SQCORE_H

#include "clockest.h"
#include "cmdqueue.h"
#include "msgblock.h"
#include "rto.h"

enum {
    SQCORE_IN_FLIGHT = 12, SQCORE_RING = 16, SQCORE_HISTORY = 128,
    SQCORE_OUT_SIZE = 2048, SQCORE_IN_SIZE = 4096,
};

struct sqblock {
    uint8_t data[MSGBLOCK_MAX];
    uint8_t len, is_resent;
    double time;                /* s, handed to the driver */
    double sent_time;           /* s, last byte on the wire */
    struct qfifo waited;
};

struct sqrecord {
    double time;
    uint8_t data[MSGBLOCK_MAX];
    uint8_t len;
};

/* The newest SQCORE_HISTORY blocks of one direction. */
struct sqhistory {
    struct sqrecord records[SQCORE_HISTORY];
    uint64_t count;
};

struct sqstats {
    uint64_t bytes_write, bytes_read, bytes_retransmit, bytes_invalid;
    uint64_t send_seq, receive_seq, retransmit_seq;
    double srtt, rttvar, rto, freq;
    uint32_t ready_bytes, upcoming_bytes;
};

struct sqcore {
    struct cmdsched sched;
    struct clockest clockest;
    struct rto rto;
    uint64_t send_seq, receive_seq;
    uint64_t ack_seq;           /* newest that came in an empty block */
    uint64_t retransmit_seq;    /* blocks before this were sent twice */
    /* Answers to come, at most; and how many of them, which come first, are
     * to what was on the way when all was sent again */
    uint32_t n_unanswered, n_stale;
    struct sqblock ring[SQCORE_RING];
    uint32_t unacked_bytes, receive_window;
    int is_synced, n_probes;
    double deadline;            /* s, when the oldest block is overdue */
    double wire_idle;           /* s, when the wire will have drained */
    double byte_time;           /* s of wire time a byte takes, 0 unknown */
    double acked_sent_time;     /* s, of the newest acked block, 0 unknown */
    uint64_t bytes_write, bytes_read, bytes_retransmit, bytes_invalid;
    uint32_t out_len, in_len;
    uint8_t out[SQCORE_OUT_SIZE], in[SQCORE_IN_SIZE];
    struct qfifo inbox;
    struct qmsg *spare;         /* says that there was no memory, once */
    struct sqhistory sent, received;
};

/* 0 or -ENOMEM. */
int sqcore_init(struct sqcore *c);
void sqcore_free(struct sqcore *c);
/* Take in bytes that arrived at `now`.  When there is no memory for a message
 * it is lost, and one without payload or notify_id goes to the inbox instead,
 * the first time. */
void sqcore_input(struct sqcore *c, double now, const uint8_t *buf,
                  size_t len);
/* Do what is due at `now`.  Returns when to be called next (> now) unless
 * something happens before; infinity when only an event can help. */
double sqcore_run(struct sqcore *c, double now);
void sqcore_get_stats(const struct sqcore *c, struct sqstats *stats);
/* Verify the invariants: 0 if they hold. */
int sqcore_check(const struct sqcore *c);

void sqhistory_note(struct sqhistory *h, double time, const uint8_t *data,
                    size_t len);

#endif
