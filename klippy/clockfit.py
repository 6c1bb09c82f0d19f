# SPDX-License-Identifier: GPL-3.0-or-later
"""A line through samples of a remote clock, newer and quicker ones first.

A sample says that the clock had a value somewhere between sending and
receiving; half of the extra round trip is how wrong its middle can be, so
samples weigh 1/(base^2 + extra^2), where base grows with the usual jitter.
See docs/internals/mcu.md.
"""

DECAY = 1. / 40.
BASE_ERROR = 0.00002
JITTER_SHARE = 0.3
START_JITTER = 0.0005
# How far crystals are off, s a s: what holds until samples know better
PRIOR_FREQ_ERROR = 0.0003
RTT_AGING = 1.0005
MIN_RTT = 0.00005


class ClockFit:
    """Estimates clock = clock_at(time) from samples.

    All times in s of the host, clocks in ticks; freq is the estimated rate.
    """

    def __init__(self, nominal_freq, time, clock):
        self.nominal_freq = nominal_freq
        self.freq = nominal_freq
        self.start_time, self.start_clock = time, float(clock)
        self.mean_time, self.mean_residual = 0., 0.
        self.weight, self.variance, self.covariance = 0., 0., 0.
        self.prior = PRIOR_FREQ_ERROR ** -2
        self.min_rtt = 1e9
        self.jitter, self.error, self.count = START_JITTER, 0., 1

    def add(self, sent_time, receive_time, clock):
        """Take in a sample; returns its distance from the line in s."""
        rtt = max(MIN_RTT, receive_time - sent_time)
        self.min_rtt = min(rtt, self.min_rtt * RTT_AGING)
        extra = (rtt - self.min_rtt) * 0.5
        self.count += 1
        self.jitter += (extra - self.jitter) * max(DECAY, 1. / self.count)
        base = BASE_ERROR + self.jitter * JITTER_SHARE
        weight = 1. / (base * base + extra * extra)
        time = (sent_time + receive_time) * 0.5
        distance = (self.clock_at(time) - clock) / self.nominal_freq
        self._update(time - self.start_time, clock, weight)
        self.error += (distance * distance - self.error) * DECAY
        return distance

    def _update(self, elapsed, clock, weight):
        """Decayed weighted mean, variance and covariance of the residuals."""
        keep = 1. - DECAY
        residual = clock - self.start_clock - elapsed * self.nominal_freq
        self.weight = self.weight * keep + weight
        share = weight / self.weight
        delta = elapsed - self.mean_time
        self.mean_time += share * delta
        self.mean_residual += share * (residual - self.mean_residual)
        self.covariance = (self.covariance * keep
                           + weight * delta * (residual - self.mean_residual))
        self.variance = (self.variance * keep
                         + weight * delta * (elapsed - self.mean_time))
        self.prior *= keep
        total = self.variance + self.prior
        if total > 0.:
            self.freq = self.nominal_freq + self.covariance / total

    def clock_at(self, time):
        """Estimated clock (float ticks) at a time."""
        elapsed = time - self.start_time
        return (self.start_clock + self.mean_residual + elapsed * self.nominal_freq
                + (elapsed - self.mean_time) * (self.freq - self.nominal_freq))

    def time_at(self, clock):
        """Estimated time of a clock."""
        anchor = self.start_time + self.mean_time
        return anchor + (clock - self.clock_at(anchor)) / self.freq
