# SPDX-License-Identifier: GPL-3.0-or-later
"""Does the sensor still follow its heater?  Ask it with small waves of power.

While a temperature is held nothing need change, so a reading that is stuck
there, or has become slow, looks healthy.  A probe adds a wave to the duty: more
for half a period, less for the other half, or the other way round, as a
pseudo-random polarity says.  The block answers with a bump of a few tenths of a
degree.  What the reading shows of it, matched with the bump's shape, is
independent of all else that goes on: nothing else knows the polarity.

    m: bump that the duty makes (degC), the control's answer in it; mean of many
    s: bump that the reading shows in one period

A live sensor has s = b m on average, with b > 0 its own (lags make it smaller than
1).  The mean of m counts, not what it was in the same period: the control answers
what else happens, so that this depends on the noise in s.  The sum of log
likelihood ratios of a live and a dead sensor decides, however long that takes with
the noise there is.
Source: docs/internals/heating.md, "Probing".
"""

import math

from klippy.record import record

# Faults that update() returns
NONE, DEAD = 0, 5

SATURATED = 0.97
# Degrees off the target at which a temperature is held
MAX_OFFSET = 6.0
# The bump (degC): of a quiet sensor, at most, in steps of the reading
LEAST_BUMP, MOST_BUMP, BUMP_STEPS = 0.3, 1.5, 4.0
# A wave takes at most this share of the mean duty
MOST_SHARE = 0.5
# Shares of b that a live and a dead sensor shows
LIVE, DEAD_SHARE = 0.6, 0.3
# b before it is known; the least it can be; square of s over its error until it is
# known
FIRST_LIVE, LEAST_GAIN, ENOUGH = 0.15, 0.15, 40.0
# Log likelihood ratios: of life, of death, at most of one period
ALIVE, DEAD_LIMIT, MOST_RATIO = 6.0, 20.0, 3.0
# Share of the last period in the estimate of the noise; the noise of steps
FORGET, STEP_NOISE = 0.12, 0.35
# The same of m, and its least share of the bump that is meant
FORGET_MEAN, LEAST_MEAN = 0.1, 0.2
# Readings in a row without any change after which it asks at once
SAME_READINGS = 60


@record(frozen=True)
class ProbeTraits:
    """s of half a wave, until its bump shows, between probes."""

    half: float
    delay: float
    idle: float


EXTRUDER = ProbeTraits(6.0, 1.5, 120.0)
BED = ProbeTraits(20.0, 5.0, 300.0)
OTHER = ProbeTraits(20.0, 5.0, 300.0)


class HeatProbe:
    """Probes one heater; add `offset` to the duty that its control wants."""

    def __init__(self, traits, seed=1):
        self.half, self.delay, self.idle = traits.half, traits.delay, traits.idle
        self.rate = 0.0
        self.random = seed
        self.gain = 0.0                 # b; 0: not known
        self.gain_s = 0.0
        self.mean = 0.0                 # m
        self.n_means = 0
        self.noise = 0.0                # variance of s (degC^2); 0: not known
        self.step = 0.0                 # least difference of two readings
        self.last = 0.0
        self.n_same = 0
        self.restart()

    def restart(self):
        """Begin with a new hold."""
        self.offset = 0.0
        self.is_asking = self.is_alive = False
        self.wait = self.idle * 0.25
        self.ratio = 0.0
        self.n_periods = 0
        self.time = 0.0
        # now acting on the duty; on the reading, later; of the period before
        self.polarity = self.shown = 0
        self.bump = self.expected = self.sum_x = self.sum_y = 0.0
        self.first_y = self.target = 0.0
        self.mean_duty = -1.0
        self.is_new = True
        self.away = 0.0
        return 0

    def update(self, elapsed, temp, target, duty, rate):
        """Take a reading; DEAD or NONE.

        rate: degC/s at full power; 0: unknown, and there are no waves.
        """
        self._note_step(temp)
        self.is_alive = False
        if rate <= 0.0 or not self._is_holding(temp, target, duty):
            self.away += elapsed
            if self.is_new or target != self.target or self.away > self.half:
                if not self.is_new:
                    self.restart()
                return NONE
        else:
            self.away = 0.0
        if self.is_new:
            self.is_new = False
            self.target, self.first_y = target, temp
            self.mean_duty = duty
            self._take_rate(rate)
        self.mean_duty += (duty - self.mean_duty) * min(elapsed / (4 * self.half), 1.0)
        self.wait -= elapsed
        if self.n_same >= SAME_READINGS:
            self.wait = min(self.wait, 0.0)
        self._follow(elapsed, temp, duty)
        return self._advance(elapsed, temp)

    def hurry(self):
        """Somebody doubts: ask at once."""
        self.wait = 0.0
        return 0

    def _take_rate(self, rate):
        """degC/s at full power, that b is relative to, until b is known."""
        if rate > 0.0 and self.gain <= 0.0 and abs(rate - self.rate) > 0.1 * rate:
            self.rate = rate
            self.gain_s = self.mean = 0.0
            self.n_means = 0
        return 0

    def _note_step(self, temp):
        change = abs(temp - self.last)
        self.last = temp
        if change < 1e-6:
            self.n_same += 1
            return 0
        self.n_same = 0
        if self.step <= 0.0 or change < self.step:
            self.step = change
        return 0

    def _is_holding(self, temp, target, duty):
        return (target > 0.0 and 0.0 < duty < SATURATED
                and abs(temp - target) < MAX_OFFSET)

    # The waves

    def _follow(self, elapsed, temp, duty):
        """Match what the duty makes, and what the reading shows, with a bump."""
        period = 2.0 * self.half
        phase = self.time + self.delay
        if phase >= period:
            phase -= period
        weight = 1.0 - abs(phase / self.half - 1.0) - 0.5
        self.bump += self.rate * (duty - self.mean_duty) * elapsed
        self.sum_x += weight * self.bump * elapsed
        weight = 1.0 - abs(self.time / self.half - 1.0) - 0.5
        self.sum_y += weight * (temp - self.first_y) * elapsed
        return 0

    def _advance(self, elapsed, temp):
        """Time goes on; what a period that ends here says."""
        period = 2.0 * self.half
        turn = period - self.delay
        is_turn = self.time < turn <= self.time + elapsed
        self.time += elapsed
        code = NONE
        if is_turn:
            self._begin_wave(period)
        if self.time >= period:
            self.time -= period
            code = self._judge(self.sum_y * 12.0 / period)
            self.first_y = temp
            self.sum_y = 0.0
        self._set_offset(period)
        return code

    def _begin_wave(self, period):
        """A wave ends and another begins on the duty."""
        self.expected = self.sum_x * 12.0 / period
        self.shown = self.polarity
        self.bump = self.sum_x = 0.0
        self.polarity = 0
        # a wave that is too small to be seen asks nothing
        room = MOST_SHARE * self.mean_duty * self.rate * self.half
        if ((self.is_asking or self.wait <= 0.0)
                and room > max(LEAST_BUMP, BUMP_STEPS * self.step)):
            self.is_asking = True
            self.random = (self.random * 1103515245 + 12345) % 2147483648
            self.polarity = 1 if self.random >= 1073741824 else -1
        return 0

    def _set_offset(self, period):
        if not self.polarity:
            self.offset = 0.0
            return 0
        phase = self.time + self.delay
        if phase >= period:
            phase -= period
        height = min(self._choose_bump() / (self.rate * self.half),
                     MOST_SHARE * self.mean_duty)
        sign = self.polarity if phase < self.half else -self.polarity
        self.offset = sign * height
        return 0

    def _choose_bump(self):
        """degC that the block may move by."""
        bump = max(LEAST_BUMP, BUMP_STEPS * self.step, math.sqrt(self.noise))
        return min(bump, MOST_BUMP)

    # What they say

    def _judge(self, shown):
        """Take what one period showed (degC)."""
        if self.shown == 0:
            self._note_noise(shown)
            return NONE
        s = self.shown * shown
        m = self._note_mean(self.shown * self.expected)
        if m < LEAST_MEAN * self._choose_bump():
            # its control, or its limits, let nothing through
            return NONE
        gain = self.gain if self.gain > 0.0 else FIRST_LIVE / LIVE
        live = LIVE * gain
        dead = DEAD_SHARE * gain if self.gain > 0.0 else 0.0
        noise = max(self.noise, (STEP_NOISE * self.step) ** 2, 1e-6)
        ratio = (live - dead) * m * (s - 0.5 * (live + dead) * m) / noise
        self.ratio += min(max(ratio, -MOST_RATIO), MOST_RATIO)
        self.n_periods += 1
        # a live sensor's own answer is no noise
        self._note_noise(s - (self.gain * m if self.ratio > 0.0 else 0.0))
        return self._decide(s, m, noise)

    def _note_mean(self, expected):
        """m with one more period (degC)."""
        self.n_means += 1
        weight = max(1.0 / self.n_means, FORGET_MEAN)
        self.mean += weight * (expected - self.mean)
        return self.mean

    def _note_noise(self, rest):
        square = rest * rest
        if self.noise <= 0.0:
            self.noise = square
        self.noise += FORGET * (square - self.noise)
        return 0

    def _decide(self, s, m, noise):
        if self.gain <= 0.0:
            self._learn(s, m, noise)
        if self.ratio < -DEAD_LIMIT:
            return DEAD
        if self.ratio > ALIVE and self.gain > 0.0:
            self.is_asking = False
            self.is_alive = True
            self.ratio = 0.0
            self.wait = self.idle
            self.n_same = 0
        return NONE

    def _learn(self, s, m, noise):
        """Find b in the first probes."""
        self.gain_s += s
        mean = self.gain_s / self.n_means
        self.ratio = min(self.ratio, ALIVE + MOST_RATIO)
        if (self.n_means >= 8 and self.ratio > ALIVE and mean > 0.0
                and mean * mean * self.n_means > ENOUGH * noise):
            self.gain = max(mean / m, LEAST_GAIN)
        return 0
