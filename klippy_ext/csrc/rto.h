/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Retransmission timeout from measured round trips (RFC 6298, with a lower
 * bound fit for a cable on the desk).  Times in seconds.
 */
#ifndef RTO_H
#define RTO_H

#define RTO_MIN 0.025
#define RTO_MAX 5.0
#define RTO_INITIAL 0.100

struct rto {
    double srtt, rttvar, timeout;
};

void rto_init(struct rto *r);
/* Note the round trip of a block that was sent exactly once. */
void rto_note_sample(struct rto *r, double rtt);
/* Note that something was acknowledged: the link works, end the backoff.
 * There is no congestion to be polite to on a cable of one's own. */
void rto_note_progress(struct rto *r);
/* Note that the timeout passed: the next one is twice as long. */
void rto_backoff(struct rto *r);

#endif
