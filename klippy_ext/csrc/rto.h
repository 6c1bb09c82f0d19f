/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Retransmission timeout from measured round trips (RFC 6298, with bounds fit
 * for a cable of one's own).  Times in seconds.
 *
 * What is behind a backlog of its own comes late without being lost.  So the
 * timeout leaves room for half a round trip more, however even they are, and
 * it stays doubled until a block that was sent once is acknowledged (Karn): else
 * each repetition makes the backlog that causes the next.  On a link that
 * worked before, repetitions stay close: it is back soon, or not at all.
 */
#ifndef RTO_H
#define RTO_H

#define RTO_MIN 0.025
#define RTO_MAX 5.0
#define RTO_INITIAL 0.100
/* Doubling goes so far (s), and to so many timeouts; a link of which nothing
 * is known yet may be a slow one: to RTO_MAX there */
#define RTO_RETRY 0.100
#define RTO_RETRY_FACTOR 4.

struct rto {
    double srtt, rttvar, timeout;
};

void rto_init(struct rto *r);
/* Note the round trip of a block that was sent exactly once. */
void rto_note_sample(struct rto *r, double rtt);
/* Note that something was acknowledged that was sent more than once. */
void rto_note_progress(struct rto *r);
/* Note that the timeout passed: the next one is longer. */
void rto_backoff(struct rto *r);
/* 0, or a negative number that says which invariant does not hold. */
int rto_check(const struct rto *r);

#endif
