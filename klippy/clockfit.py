# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a remote clock is ahead, from samples whose delays vary.

Each way has a least delay, and how much longer it takes is random: all samples
bound the clock, in both directions (ClockBounds).  Between the bounds lies a
parabola: offset, frequency and its drift.  For each frequency and drift the
tightest offsets follow, and how likely that pair is, with delays beyond the
least as if exponential.  The mean over all pairs, so weighted, is the estimate.
See docs/internals/clocks.md.
"""

from math import exp, sqrt

from klippy.clockbounds import ClockBounds

# How far crystals are off (s a s), and how fast that changes (1/s): 1 ppm/minute
PRIOR_FREQ = 0.0003
PRIOR_DRIFT = 1e-6 / 60.
# The window grows with the root of the jitter; s
MIN_WINDOW, MAX_WINDOW = 30., 180.
WINDOW_OF_JITTER = 1900.
# Jitter over number of samples that is aimed at, s
RESOLUTION = 0.6e-6
MIN_INTERVAL, MAX_INTERVAL = 0.0125, 0.9839
# Least delays vary this much themselves, s
MIN_JITTER = 0.00001
START_JITTER = 0.0003
JITTER_DECAY = 1. / 50.
# A sample beyond the bounds by this many times jitter over number of samples shows
# that the drift has changed: half of the window is of no use then
BREACH = 10.
# s between fits, and the part of the time since the oldest sample
FIT_INTERVAL, FIT_PART = 0.9, 0.1
RTT_AGING = 1.0005
# The grid of frequencies and drifts: half width in deviations, steps a side
GRID_WIDTH = 3.5
N_FREQS, N_DRIFTS = 8, 5
MAX_PASSES = 40
# A grid fits if the deviation is this share of its half width
MIN_SHARE, MAX_SHARE = 0.12, 0.45


class GridMean:
    """Mean and deviations over a grid of frequencies and drifts."""

    def __init__(self):
        self.best, self.total = -1e300, 0.
        self.upper = self.lower = 0.
        self.gain = self.gain2 = self.drift = self.drift2 = 0.

    def add(self, likely, upper, lower, gain, drift):
        """Take in a point; likely is the logarithm of its weight."""
        if likely > self.best:
            self._scale(exp(self.best - likely))
            self.best = likely
        weight = exp(likely - self.best)
        self.total += weight
        self.upper += weight * upper
        self.lower += weight * lower
        self.gain += weight * gain
        self.gain2 += weight * gain * gain
        self.drift += weight * drift
        self.drift2 += weight * drift * drift
        return 0

    def finish(self):
        """Turn sums into means, squares into deviations."""
        self._scale(1. / self.total)
        self.gain2 = sqrt(max(self.gain2 - self.gain * self.gain, 0.))
        self.drift2 = sqrt(max(self.drift2 - self.drift * self.drift, 0.))
        return 0

    def _scale(self, factor):
        self.total *= factor
        self.upper *= factor
        self.lower *= factor
        self.gain *= factor
        self.gain2 *= factor
        self.drift *= factor
        self.drift2 *= factor
        return 0


class ClockFit:
    """Estimates clock = clock_at(time) from samples.

    All times in s of the host, clocks in ticks.
    """

    def __init__(self, nominal_freq, time, clock):
        self.nominal_freq = nominal_freq
        self.start_time, self.start_clock = time, float(clock)
        self.bounds = ClockBounds()
        # At mean_time (s since the start), the mean of all samples, whose mean
        # square of distance in time is spread: s ahead, s a s, 1/s
        self.mean_time, self.spread = 0., 0.
        self.ahead, self.gain, self.drift = 0., 0., 0.
        # Between the bounds, s: the least round trip if there were no luck
        self.width = 0.
        self.gain_error, self.drift_error = PRIOR_FREQ, PRIOR_DRIFT
        # Mean of the delay beyond the least, to and from the mcu
        self.jitter_to = self.jitter_from = START_JITTER
        self.min_rtt, self.error, self.count = 1e9, 0., 0
        self.fit_time = -1e9

    # What others ask

    def get_jitter(self):
        """About how much longer than the quickest a way may take, s."""
        return 2. * max(self.jitter_to, self.jitter_from)

    def get_window(self):
        """For how long samples are kept, s."""
        return min(max(WINDOW_OF_JITTER * sqrt(self.get_jitter()), MIN_WINDOW),
                   MAX_WINDOW)

    def get_interval(self):
        """After what time (s) another sample is wanted."""
        return min(max(RESOLUTION * self.get_window() / self.get_jitter(),
                       MIN_INTERVAL), MAX_INTERVAL)

    def line_at(self, time):
        """(clock, ticks a s) of the estimate at a time."""
        elapsed = time - self.start_time
        gain = self.gain + self.drift * (elapsed - self.mean_time)
        clock = self.start_clock + self.nominal_freq * (
            elapsed + self._ahead_at(elapsed))
        return clock, self.nominal_freq * (1. + gain)

    def clock_at(self, time):
        """Estimated clock (float ticks) at a time."""
        elapsed = time - self.start_time
        return self.start_clock + self.nominal_freq * (
            elapsed + self._ahead_at(elapsed))

    def _ahead_at(self, elapsed):
        later = elapsed - self.mean_time
        return self.ahead + later * self.gain + 0.5 * self.drift * (
            later * later - self.spread)

    # Samples

    def add(self, sent_time, receive_time, clock):
        """Take in a sample; returns its distance from the estimate in s."""
        sent, received = sent_time - self.start_time, receive_time - self.start_time
        read = (clock - self.start_clock) / self.nominal_freq
        rtt = received - sent
        self.min_rtt = min(rtt, self.min_rtt * RTT_AGING)
        if not self.count:
            self.ahead, self.mean_time = read - sent - 0.5 * rtt, sent
            self.width = rtt
        self.count += 1
        self.bounds.add(sent, received, read, self.gain + self.drift * (
            sent - self.mean_time), self.get_window())
        self._note_delays(sent, read - sent - self._ahead_at(sent),
                          received - read + self._ahead_at(received))
        middle = 0.5 * (sent + received)
        distance = self._ahead_at(middle) - (read - middle)
        self.error += (distance * distance - self.error) * JITTER_DECAY
        if sent - self.fit_time >= min(
                FIT_INTERVAL, (sent - self.bounds.get_start()) * FIT_PART):
            self.fit_time = sent
            self._fit()
        return distance

    def _note_delays(self, sent, to, back):
        """Follow the jitter and see whether the estimate can still be true."""
        to -= 0.5 * self.width
        back -= 0.5 * self.width
        share = max(JITTER_DECAY, 1. / (self.count + 5))
        self.jitter_to += (max(to, MIN_JITTER) - self.jitter_to) * share
        self.jitter_from += (max(back, MIN_JITTER) - self.jitter_from) * share
        bounds = self.bounds
        start = bounds.get_start()
        limit = MIN_JITTER + BREACH * self.get_jitter() / bounds.count
        if sent - start > MIN_WINDOW and min(to, back) < -limit:
            bounds.forget(0.5 * (sent + start))
            self.fit_time = -1e9
        return 0

    # The fit

    def _fit(self):
        """Weigh grids around the estimate until one has the right size."""
        self._center()
        for _ in range(MAX_PASSES):
            gain_width = self.gain_error * GRID_WIDTH
            drift_width = self.drift_error * GRID_WIDTH
            self._take(self._weigh(gain_width, drift_width), gain_width, drift_width)
            if (MIN_SHARE < self.gain_error / gain_width < MAX_SHARE
                    and MIN_SHARE < self.drift_error / drift_width < MAX_SHARE):
                break
        return 0

    def _center(self):
        """Refer the estimate to the mean time of all samples."""
        total, moment, spread = 0., 0., 0.
        for s in self.bounds.stretches:
            total += s.count
            moment += s.count * s.sent
        mean = moment / total
        for s in self.bounds.stretches:
            spread += s.count * (s.sent - mean) * (s.sent - mean)
        spread /= total
        self.ahead = self._ahead_at(mean) + 0.5 * self.drift * spread
        self.gain += self.drift * (mean - self.mean_time)
        self.mean_time, self.spread = mean, spread
        return 0

    def _weigh(self, gain_width, drift_width):
        """The GridMean of a grid of that half width."""
        grid = GridMean()
        weight_to = 0.5 * self.bounds.count / self.jitter_to
        weight_from = 0.5 * self.bounds.count / self.jitter_from
        for j in range(-N_DRIFTS, N_DRIFTS + 1):
            drift_step = drift_width * j / N_DRIFTS
            drift = self.drift + drift_step
            for i in range(-N_FREQS, N_FREQS + 1):
                gain_step = gain_width * i / N_FREQS
                gain = self.gain + gain_step
                upper, lower = self._enclose(gain, drift)
                likely = upper * weight_to - lower * weight_from - 0.5 * (
                    (gain / PRIOR_FREQ) ** 2 + (drift / PRIOR_DRIFT) ** 2)
                grid.add(likely, upper, lower, gain_step, drift_step)
        grid.finish()
        return grid

    def _enclose(self, gain, drift):
        """(upper, lower) bounds of `ahead` for a frequency and a drift."""
        upper, lower = 1e300, -1e300
        for s in self.bounds.stretches:
            later = s.sent - self.mean_time
            upper = min(upper, s.upper - later * gain
                        - 0.5 * drift * (later * later - self.spread))
            later = s.received - self.mean_time
            lower = max(lower, s.lower - later * gain
                        - 0.5 * drift * (later * later - self.spread))
        return upper, lower

    def _take(self, grid, gain_width, drift_width):
        """Make the mean of a grid the estimate.

        A grid that is too coarse shows no deviation at all, and one that lies beside
        what is likely too small a one.
        """
        self.ahead = 0.5 * (grid.upper + grid.lower)
        self.width = grid.upper - grid.lower
        self.gain += grid.gain
        self.drift += grid.drift
        self.gain_error = max(grid.gain2, 0.5 * MIN_SHARE * gain_width,
                              2. * abs(grid.gain) - gain_width)
        self.drift_error = max(grid.drift2, 0.5 * MIN_SHARE * drift_width,
                               2. * abs(grid.drift) - drift_width)
        return 0
