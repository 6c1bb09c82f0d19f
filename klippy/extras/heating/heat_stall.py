# SPDX-License-Identifier: GPL-3.0-or-later
"""Does a temperature stand still that cannot?  Needs nothing learned before.

At full power a heater rises as it did before at the same temperature: less only by
a weaker supply and more losses, which the difference to its steepest rise tells
the size of.  Two points are kept, (degC, degC/s) of the steepest and of the last
rise, and a line through them.  Without power whatever is much warmer than a room
gets colder.  What a reading lacks is summed up.
"""

from klippy.record import record

# Faults that update() returns
NONE, TOO_WARM, TOO_COLD = 0, 1, 2

SATURATED = 0.95
# The weakest supply, and how much the losses may have grown
SUPPLY, LOSSES, FAN_LOSSES = 0.85, 1.86, 2.2
# Share of the least rise that is asked for
LEAST_SHARE = 0.5
# A rise is taken anew while a sum is below this share of its limit, and if it is
# no less than this share of what it was
CALM, LEAST_CHANGE = 0.3, 0.6
# A new stretch of full power may lack more, as a cold plate may have been put on
NEW_STRETCH = 2.0
# Share of the degrees that the power held it by that must be gone after `rest`
MUST_FALL, LEAST_HELD = 0.1, 10.0
# degC above the room that air around a heater may reach
WARM_AIR = 45.0


@record(frozen=True)
class StallTraits:
    """lag: s until power shows.  window: s of one slope.  fast, slow: s, time
    constants of the fastest and the slowest heater.  limits: degC that a climb
    and a cooling may lack.  rest: s without power."""

    lag: float
    window: float
    fast: float
    slow: float
    climb_limit: float
    fall_limit: float
    rest: float


EXTRUDER = StallTraits(10.0, 3.0, 20.0, 1500.0, 6.0, 10.0, 900.0)
BED = StallTraits(30.0, 15.0, 60.0, 5000.0, 8.0, 10.0, 2400.0)
OTHER = StallTraits(30.0, 15.0, 60.0, 5000.0, 8.0, 10.0, 2400.0)


class StallWatch:
    """Watches one heater, reading by reading."""

    def __init__(self, traits):
        self.lag, self.window = traits.lag, traits.window
        self.fast, self.slow = traits.fast, traits.slow
        self.climb_limit, self.fall_limit = traits.climb_limit, traits.fall_limit
        self.rest = traits.rest
        # degC/s at full power, and where that was (degC)
        self.steepest = self.steepest_temp = 0.0
        self.slope = self.slope_temp = 0.0
        self.slope_fan = -1
        self.restart()

    def restart(self):
        """Forget the last minutes (not what was learned)."""
        self.full_time = self.off_time = 0.0
        self.climb_sum = self.fall_sum = 0.0
        self.mean_duty = self.held = self.held_temp = 0.0
        self.window_time = self.window_temp = 0.0
        self.is_new = True
        return 0

    def update(self, elapsed, temp, change, duty, above, fan, flow, hold):
        """Take a reading; NONE, TOO_WARM or TOO_COLD.

        change: degC since the last one.  above: degC over the room.  fan: range of
        the fan.  flow: duty a degree (1/K) that filament may take.  hold: that it
        needs; 0: not known.
        """
        if duty < SATURATED:
            self.full_time = self.climb_sum = self.window_time = 0.0
            self.is_new = True
        else:
            self.full_time += elapsed
            self._watch_climb(elapsed, temp, change, fan, above * flow)
        share = min(4.0 * elapsed / self.rest, 1.0)
        self.mean_duty += share * (duty - self.mean_duty)
        if duty > 0.0:
            self.off_time = self.fall_sum = 0.0
            self.held_temp = temp
            self.held = 0.0 if hold <= 0.0 else min(self.mean_duty / hold, above)
        else:
            self.off_time += elapsed
            if self._has_stayed(elapsed, temp):
                return TOO_WARM
            if self.off_time > self.lag:
                self._watch_fall(elapsed, change, above)
        if self.climb_sum > self.climb_limit * (NEW_STRETCH if self.is_new else 1.0):
            return TOO_COLD
        return TOO_WARM if self.fall_sum > self.fall_limit else NONE

    def find_rise(self, temp):
        """degC/s that it rose by at this temperature."""
        if temp <= self.steepest_temp:
            return self.steepest
        if temp > self.slope_temp:
            return self.slope - (temp - self.slope_temp) / self.fast
        share = (temp - self.steepest_temp) / (self.slope_temp - self.steepest_temp)
        return self.steepest + share * (self.slope - self.steepest)

    def _watch_climb(self, elapsed, temp, change, fan, flow):
        if self.steepest > 0.0 and self.full_time > self.lag:
            losses = self.steepest - self.find_rise(temp)
            worse = LOSSES if fan == self.slope_fan else LOSSES * FAN_LOSSES
            least = SUPPLY * self.steepest - worse * losses - flow * self.steepest
            least = LEAST_SHARE * max(least, 0.0)
            self.climb_sum = max(self.climb_sum + least * elapsed - change, 0.0)
        if self.window_time <= 0.0:
            self.window_temp = temp
        self.window_time += elapsed
        if self.window_time >= self.window:
            self._take_slope((temp - self.window_temp) / self.window_time, temp, fan)
        return 0

    def _take_slope(self, slope, temp, fan):
        self.window_time = 0.0
        if slope >= self.steepest:
            self.steepest, self.steepest_temp = slope, temp
        elif (self.full_time < self.lag or self.climb_sum > CALM * self.climb_limit
                or slope < LEAST_CHANGE * self.find_rise(temp)):
            # a rise that is only beginning, or that is in doubt
            return 0
        self.is_new = False
        self.slope, self.slope_temp, self.slope_fan = slope, temp, fan
        return 0

    def _has_stayed(self, elapsed, temp):
        """Is it as warm as before, a long time after its power went?"""
        if not self.rest <= self.off_time < self.rest + elapsed:
            return False
        return (self.held > LEAST_HELD
                and temp > self.held_temp - MUST_FALL * self.held)

    def _watch_fall(self, elapsed, change, above):
        least = max(above - WARM_AIR, 0.0) / self.slow
        self.fall_sum = max(self.fall_sum + change + least * elapsed, 0.0)
        return 0
