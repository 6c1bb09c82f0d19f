/* SPDX-License-Identifier: GPL-3.0-or-later
 * Retransmission timeout.  See rto.h. */
#include <math.h>

#include "rto.h"

void
rto_init(struct rto *r)
{
    r->srtt = r->rttvar = 0.;
    rto_note_progress(r);
}

void
rto_note_progress(struct rto *r)
{
    double timeout = r->srtt > 0. ? r->srtt + 4. * r->rttvar : RTO_INITIAL;

    r->timeout = fmin(fmax(timeout, RTO_MIN), RTO_MAX);
}

void
rto_note_sample(struct rto *r, double rtt)
{
    if (r->srtt > 0.) {
        r->rttvar += (fabs(r->srtt - rtt) - r->rttvar) / 4.;
        r->srtt += (rtt - r->srtt) / 8.;
    } else {
        r->srtt = rtt;
        r->rttvar = rtt / 2.;
    }
    rto_note_progress(r);
}

void
rto_backoff(struct rto *r)
{
    r->timeout = fmin(2. * r->timeout, RTO_MAX);
}
