/* SPDX-License-Identifier: GPL-3.0-or-later
 * Retransmission timeout.  See rto.h. */
#include <math.h>

#include "rto.h"

void
rto_init(struct rto *r)
{
    r->srtt = r->rttvar = 0.;
    r->timeout = RTO_INITIAL;
}

static double
calc_timeout(const struct rto *r)
{
    double timeout = r->srtt + fmax(4. * r->rttvar, 0.5 * r->srtt);

    return fmin(fmax(timeout, RTO_MIN), RTO_MAX);
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
    r->timeout = calc_timeout(r);
}

void
rto_note_progress(struct rto *r)
{
    if (r->srtt > 0.)
        r->timeout = fmin(r->timeout, 2. * calc_timeout(r));
}

void
rto_backoff(struct rto *r)
{
    double limit = RTO_MAX;

    if (r->srtt > 0.)
        limit = fmax(RTO_RETRY, RTO_RETRY_FACTOR * calc_timeout(r));
    r->timeout = fmin(2. * r->timeout, fmin(limit, RTO_MAX));
}

int
rto_check(const struct rto *r)
{
    if (!(r->srtt >= 0.) || !(r->rttvar >= 0.))
        return -70;
    return r->timeout >= RTO_MIN && r->timeout <= RTO_MAX ? 0 : -71;
}
