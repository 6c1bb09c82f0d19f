/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Messages of one link that wait to be sent, and the choice of the next.
 *
 * Every command queue is strictly first in, first out.  A message is upcoming
 * until the mcu's clock reaches its release clock (min_clock, or 2^31 ticks
 * before req_clock if that is later, because the wire carries 32 bit clocks);
 * then it is ready.  Among the queues the one with the earliest required
 * clock goes first; a message pulls those before it in its queue along.
 *
 * Invariant: upcoming_bytes and ready_bytes are the sums over all queues.
 * No locks: the owner serialises.
 */
#ifndef CMDQUEUE_H
#define CMDQUEUE_H

#include "qmsg.h"

struct cmdqueue {
    struct qsink sink;          /* for producers; set by the owner */
    void *owner;
    struct qfifo upcoming, ready;
    uint64_t urgent_clock;      /* lower bound of req_clock in ready */
    uint64_t last_clock;        /* req_clock of the last message readied */
    int is_sorted;              /* ready holds ascending req_clock */
};

struct cmdsched {
    struct cmdqueue **queues;
    int n_queues;
    uint32_t upcoming_bytes, ready_bytes;
    uint64_t next_release;      /* no upcoming head is released before */
};

void cmdsched_init(struct cmdsched *s);
/* Free all queues and messages. */
void cmdsched_free(struct cmdsched *s);
/* New empty queue, owned by the scheduler; NULL when out of memory. */
struct cmdqueue *cmdsched_add_queue(struct cmdsched *s);
/* Append messages to a queue; empties batch. */
void cmdsched_push(struct cmdsched *s, struct cmdqueue *cq,
                   struct qfifo *batch);
/* Make ready what is released at `clock`. */
void cmdsched_release(struct cmdsched *s, uint64_t clock);
/* Earliest required clock of the ready messages, UINT64_MAX if none. */
uint64_t cmdsched_get_urgent(const struct cmdsched *s);
/* Move ready messages into a payload of at most `room` bytes.  Those that
 * somebody waits for go to `waited`, the others are freed.  Returns the
 * payload's length; 0 if the first message does not fit. */
uint32_t cmdsched_fill(struct cmdsched *s, uint8_t *payload, uint32_t room,
                       struct qfifo *waited);
/* Verify the invariants: 0 if they hold. */
int cmdsched_check(const struct cmdsched *s);

#endif
