# SPDX-License-Identifier: GPL-3.0-or-later
"""Is what a sensor shows what its heater can have done?

The model of thermal_model.py in units of its own heater: with duty u and
reading y,

    dy/dt = a (u - g (y - Ta))

a: degC/s at full power without losses; g: duty that holds a degree above the
room Ta.  Both are learned while all is well (or were measured), and taken
with wide margins: from the highest duty of the last seconds and the least
losses comes the fastest rise that is possible, from the lowest duty and the
most losses the slowest.  What a reading rises beyond the one, or lacks to the
other, is summed up and may sink back to 0; a sum above its limit is a fault.
"""

import array

from klippy.record import record

# Faults that update() returns
NONE, TOO_WARM, TOO_COLD, NO_ANSWER, JUMPS = range(5)

N_FANS = 4                  # fan speeds are told apart as 0 and three ranges
# What a and g are multiplied with for the extremes
# (a: how far off it may be, more where little of the heat stayed in the block)
RATE_BELOW, RATE_ABOVE, RATE_SHARE = 0.3, 0.5, 0.55
RISEN_SHARE = 1.3
HOLD_LOW, HOLD_HIGH = 0.4, 1.45
# For a fan speed never seen, and before g is known
FAN_HIGH = 2.2
# The room may have become warmer or colder by so much (degC)
ROOM_RISE, ROOM_FALL = 20.0, 8.0
WARM_AIR = 40.0
FIRST_ROOM, MAX_ROOM = 25.0, 45.0
# Below this temperature any heater gets warmer at full power
SURE_TO_RISE = 60.0
# Full power says only that more would be needed
SATURATED = 0.95
# Learning: degC that a window swings, begins and ends apart, is above the room;
# share of the heat that must have stayed in the heater, and how much less than
# the best so far is still taken
REST_GAIN, MIN_ABOVE_ROOM = 1.5, 15.0
# Share of the degrees above the room that it may swing by; a window waits so many
# times its time until a swing is over
MAX_SWING, MAX_WINDOWS = 0.35, 4.0
LEAST_SHARE, SHARE_LOSS = 0.5, 0.1
# lags of a window that a slope is taken from
CLIMB_WINDOW = 0.5
# and degC that its mean may be off the target: not for long, if all is well
MAX_OFFSET = 2.5
# Windows' needs above HOLD_HIGH times g, summed up: more is a fault
# (at most one step each); degC that such a window may swing by
MAX_EXCESS, EXCESS_STEP, EXCESS_SWING = 1.8, 0.5, 25.0
# Share of the heat of a window that may have gone into the block
MAX_STORED = 0.3
# g may move so far from its value after the first windows
N_REFERENCE, REFERENCE_LOW, REFERENCE_HIGH = 8, 0.67, 1.12
LEAST_WEIGHT = 0.1
# A sensor that jumps: degC, jumps, s in which one is forgotten
JUMP, MAX_JUMPS, JUMP_TIME = 8.0, 8.0, 15.0
# Readings further apart (s) are not compared
MAX_GAP = 4.0


@record(frozen=True)
class WatchTraits:
    """What kind of heater it is.

    lag: s until a change of power shows in full.  hold_time: s of a window
    that g is learned in.  least_climb: degC for a.  drift: degC/s that
    neighbours may warm it by.  limit, limit_time: a sum may be limit +
    limit_time * a (degC).  least_rate: degC/s at full power near the room.
    most_rate: degC/s, up or down, as long as nothing is known.
    """

    lag: float
    hold_time: float
    least_climb: float
    drift: float
    limit: float
    limit_time: float
    least_rate: float
    most_rate: float


EXTRUDER = WatchTraits(10.0, 30.0, 15.0, 0.15, 10.0, 1.5, 0.025, 30.0)
BED = WatchTraits(45.0, 120.0, 8.0, 0.02, 10.0, 12.0, 0.008, 5.0)
OTHER = WatchTraits(45.0, 120.0, 10.0, 0.05, 15.0, 12.0, 0.008, 15.0)


def choose(values, index, spread):
    """Of values, one a fan range, that of a range, else the highest times spread."""
    if values[index] > 0.0:
        return values[index]
    found = 0.0
    for i in range(N_FANS):
        found = max(found, values[i])
    return found * spread


class HeatWatch:
    """Watches one heater, reading by reading."""

    def __init__(self, traits):
        self.lag, self.hold_time = traits.lag, traits.hold_time
        self.least_climb, self.drift = traits.least_climb, traits.drift
        self.limit, self.limit_time = traits.limit, traits.limit_time
        self.least_rate, self.most_rate = traits.least_rate, traits.most_rate
        self.room = FIRST_ROOM
        self.is_first = True
        self.rate = 0.0                 # a, 0: not known
        self.rate_low = self.rate_high = self.share = 0.0
        # degC/s that it rose by at full power, as others saw it
        self.risen = 0.0
        nothing = [0.0] * N_FANS
        self.holds = array.array("d", nothing)      # g, 0: not known
        self.references = array.array("d", nothing)
        self.n_holds = array.array("l", [0] * N_FANS)
        self.before = self.last = self.temp = 0.0
        self.n_jumps = self.change = 0.0
        self.steepest = self.steep_above = self.climb_start = 0.0
        self.fan_range = 0
        self.restart()

    def restart(self):
        """Forget the last minutes (not what was learned): power is unknown."""
        self.warm_sum = self.cold_sum = self.still_sum = self.excess = 0.0
        self.duty_low, self.duty_high = 0.0, 1.0
        self.old_low, self.old_high = 0.0, 1.0
        self.half_time = 0.0
        self.is_fresh = True
        self.n_fresh = 3
        self.has_anchor = self.temp < MAX_ROOM
        self.anchor_temp = self.temp
        self.heat = self.above = 0.0
        self.hold_left = 0.0
        self.hold_index = 0
        return 0

    def set_known(self, rate, holds):
        """Take measured values: a (degC/s) and g (1/K) for each fan range."""
        self._set_rate(rate, 1.0)
        self.holds = array.array("d", holds)
        self.references = array.array("d", holds)
        self.n_holds = array.array("l", [N_REFERENCE] * N_FANS)

    def get_holds(self):
        """List of g (1/K) for each fan range; 0: not known."""
        return list(self.holds)

    def update(self, elapsed, temp, target, duty, fan, flow):
        """Take a reading `elapsed` s after the one before; the fault or NONE.

        target: degC.  duty: 0..1 since then.  fan: 0..1.  flow: duty a degree
        (1/K) that filament may take at most.
        """
        if self.is_first:
            self._begin(temp)
        if elapsed > MAX_GAP or elapsed <= 0.0:
            self.restart()
        self.change = change = self._filter(temp, elapsed)
        self._note_duty(duty, elapsed)
        if self.is_fresh:
            # the filter still holds readings from before
            self.n_fresh -= 1
            self.is_fresh = self.n_fresh > 0
            return NONE
        self.fan_range = index = 0 if fan < 0.05 else 1 + min(int(fan * 3.0), 2)
        self._sum_up(change, elapsed, index, flow)
        self._learn(elapsed, target, duty, index, flow)
        return self._judge()

    # Readings

    def _begin(self, temp):
        self.is_first = False
        self.before = self.last = self.temp = temp
        # what is as cold as a room rests
        self.has_anchor = temp < MAX_ROOM
        self.anchor_temp = temp
        if temp < MAX_ROOM:
            self.room = temp

    def _filter(self, temp, elapsed):
        """Change (degC) of the median of the last three readings."""
        if abs(temp - self.last) > JUMP + 2.0 * self.rate * elapsed:
            self.n_jumps += 1.0
        self.n_jumps = max(self.n_jumps - elapsed / JUMP_TIME, 0.0)
        low, high = min(self.before, self.last), max(self.before, self.last)
        middle = min(max(temp, low), high)
        change, self.temp = middle - self.temp, middle
        self.before, self.last = self.last, temp
        return change

    def _note_duty(self, duty, elapsed):
        """Extremes of the duty over the last one to two lags."""
        self.half_time += elapsed
        if self.half_time >= self.lag:
            self.old_low, self.old_high = self.duty_low, self.duty_high
            self.duty_low = self.duty_high = duty
            self.half_time = 0.0
            return 0
        if duty < self.duty_low or self.half_time <= elapsed:
            self.duty_low = duty
        if duty > self.duty_high or self.half_time <= elapsed:
            self.duty_high = duty
        return 0

    # What is possible

    def _find_hold(self, index, is_high):
        """g for a fan range: the most or the least it may be; 0: not known."""
        if self.holds[index] > 0.0:
            return self.holds[index]
        found = 0.0
        for i in range(N_FANS):
            hold = self.holds[i]
            if hold > 0.0 and (found == 0.0 or (hold > found) == is_high):
                found = hold
        return found * FAN_HIGH if is_high else found / FAN_HIGH

    def choose_hold(self, index):
        """g (1/K) that is likely for a fan range; 0: not known for any."""
        return choose(self.holds, index, 1.0)

    def find_reference(self, index):
        """g (1/K) of the first windows, at most, for a fan range; 0: not known."""
        return choose(self.references, index, FAN_HIGH)

    def _sum_up(self, change, elapsed, index, flow):
        low, high = min(self.duty_low, self.old_low), max(self.duty_high, self.old_high)
        above = self.temp - self.room
        fastest = 0.0 if high == 0.0 else self.most_rate
        slowest = -self.most_rate
        if self.rate > 0.0:
            least = HOLD_LOW * self._find_hold(index, False)
            fastest = high - least * max(above - ROOM_RISE, 0.0)
            # the rate may have been learned too low; what it did it can do again
            fastest *= (max(self.rate_high, RISEN_SHARE * self.risen)
                        if fastest > 0.0 else self.rate_low)
            most = HOLD_HIGH * self._find_hold(index, True) + flow
            slowest = low - most * max(above + ROOM_FALL, 0.0)
            slowest *= self.rate_low if slowest > 0.0 else self.rate_high
        # neighbours warm what is not far above the room
        drift = self.drift * min(max(1.0 - above / WARM_AIR, 0.0), 1.0)
        self.warm_sum = max(self.warm_sum + change - (fastest + drift) * elapsed, 0.0)
        self.cold_sum = max(self.cold_sum + slowest * elapsed - change, 0.0)
        self._watch_answer(change, elapsed, low)
        if high == 0.0 and self.temp < self.room:
            self.room = self.temp
        return 0

    def _watch_answer(self, change, elapsed, low):
        """A heater that is not much warmer than a room must rise at full power."""
        if low < SATURATED or self.temp > SURE_TO_RISE:
            self.still_sum = 0.0
            return 0
        self.still_sum = max(
            self.still_sum + self.least_rate * elapsed - change, 0.0)
        return 0

    def _judge(self):
        limit = self.limit + self.limit_time * self.rate
        if self.warm_sum > limit:
            return TOO_WARM
        if self.cold_sum > limit or self.excess > MAX_EXCESS:
            return TOO_COLD
        if self.still_sum > 3.0:
            return NO_ANSWER
        return JUMPS if self.n_jumps > MAX_JUMPS else NONE

    # Learning

    def _learn(self, elapsed, target, duty, index, flow):
        limit = 0.5 * (self.limit + self.limit_time * self.rate)
        if max(self.warm_sum, self.cold_sum) > limit or self.n_jumps > 2.0:
            self.hold_left = 0.0
            self.has_anchor = False
            return 0
        self.heat += duty * elapsed
        self.above += (self.temp - self.room) * elapsed
        low, high = min(self.duty_low, self.old_low), max(self.duty_high, self.old_high)
        is_holding = low < SATURATED
        self._note_climb(elapsed, low)
        if index != self.hold_index or not is_holding or self.hold_left <= 0.0:
            self._begin_window(index, is_holding)
            return 0
        self.hold_left -= elapsed
        self.hold_span += elapsed
        self.hold_heat += duty * elapsed
        self.hold_offset += (self.temp - target) * elapsed
        self.hold_flow += flow * max(self.temp - self.room, 0.0) * elapsed
        self.hold_above += (self.temp - self.room) * elapsed
        self.hold_min = min(self.hold_min, self.temp)
        self.hold_max = max(self.hold_max, self.temp)
        if self.hold_left <= 0.0:
            self._end_window(index, target, high == 0.0)
        return 0

    def _note_climb(self, elapsed, low):
        """Keep the steepest slope at full power, and where it was."""
        if low < SATURATED:
            self.climb_time = 0.0
            return 0
        if self.climb_time <= 0.0:
            self.climb_start = self.temp
        self.climb_time += elapsed
        if self.climb_time < CLIMB_WINDOW * self.lag:
            return 0
        slope = (self.temp - self.climb_start) / self.climb_time
        self.climb_time = 0.0
        if slope > self.steepest:
            self.steepest = slope
            self.steep_above = 0.5 * (self.temp + self.climb_start) - self.room
        return 0

    def _end_window(self, index, target, is_off):
        """Take what a window shows; one of swings ends where it began."""
        if (not is_off and abs(self.temp - self.hold_start) > REST_GAIN
                and self.hold_min + REST_GAIN < self.hold_start
                and self.hold_start < self.hold_max - REST_GAIN
                and self.hold_span < MAX_WINDOWS * self.hold_time):
            self.hold_left = 1e-6
            return 0
        self._take_window(index, target, is_off)
        return 0

    def _begin_window(self, index, is_holding):
        self.hold_index = index
        self.hold_left = self.hold_time if is_holding else 0.0
        self.hold_start = self.hold_min = self.hold_max = self.temp
        self.hold_heat = self.hold_above = self.hold_offset = self.hold_span = 0.0
        self.hold_flow = 0.0
        return 0

    def _take_window(self, index, target, is_off):
        """A window at rest or at one temperature: learn from it."""
        gain = self.temp - self.hold_start
        if is_off:
            if abs(gain) < REST_GAIN:
                self._set_anchor()
            return 0
        stored = 0.0 if self.rate <= 0.0 else gain / self.rate
        # what swings across its target is not stuck, however lopsided
        is_across = self.hold_min < target < self.hold_max
        if abs(stored) < MAX_STORED * self.hold_heat:
            self._note_excess(index, self.hold_heat - stored)
        if ((self.hold_max - self.hold_min) * self.hold_span
                > MAX_SWING * self.hold_above
                or (abs(self.hold_offset) > MAX_OFFSET * self.hold_span
                    and not is_across)
                or abs(stored) > MAX_STORED * self.hold_heat
                or (self.rate <= 0.0 and abs(gain) > REST_GAIN)
                or self.hold_above < MIN_ABOVE_ROOM * self.hold_span):
            return 0
        self._take_hold(index, (self.hold_heat - stored) / self.hold_above)
        if abs(gain) < REST_GAIN:
            self._take_rate(index)
            self._set_anchor()
        return 0

    def _note_excess(self, index, heat):
        """A window that needs more than the losses can take (s at full power)."""
        swing = self.hold_max - self.hold_min
        if (self.n_holds[index] < N_REFERENCE or self.rate <= 0.0
                or swing > EXCESS_SWING):
            return 0
        need = self.holds[index] * (self.hold_above + ROOM_FALL * self.hold_span)
        if need > 0.0:
            excess = (heat - self.hold_flow) / need - HOLD_HIGH
            self.excess = max(self.excess + min(excess, EXCESS_STEP), 0.0)
        return 0

    def _take_hold(self, index, hold):
        """g of one window."""
        self.n_holds[index] += 1
        n = self.n_holds[index]
        known = self.holds[index]
        known += (hold - known) * max(1.0 / n, LEAST_WEIGHT)
        if n <= N_REFERENCE:
            self.references[index] = known
        reference = self.references[index]
        if n > N_REFERENCE:
            known = min(max(known, REFERENCE_LOW * reference),
                        REFERENCE_HIGH * reference)
        self.holds[index] = known
        return 0

    def _take_rate(self, index):
        """a, from all heat since the last time of rest at a lower temperature.

        Where most of that was lost, from the steepest slope of a climb.
        """
        gain = self.temp - self.anchor_temp
        is_done = (self.has_anchor and gain >= self.least_climb
                   and self._take_climb(
                       gain, self.heat, self.holds[index] * self.above))
        if not is_done and self.steepest > 0.0:
            least = self._find_hold(0, False) * self.steep_above
            self._take_climb(self.steepest, 1.0, min(max(least, 0.0), 1.0))
        return 0

    def _take_climb(self, gain, heat, lost):
        """Learn a from a climb (degC, s, s that were lost); is it fit for that?"""
        share = 0.0 if heat <= 0.0 else (heat - lost) / heat
        if share < max(LEAST_SHARE, self.share - SHARE_LOSS):
            return False
        rate = gain / (heat - lost)
        if self.rate > 0.0 and share < self.share + SHARE_LOSS:
            rate = 0.5 * (self.rate + rate)
        self._set_rate(rate, max(share, self.share))
        return True

    def _set_rate(self, rate, share):
        self.rate, self.share = rate, share
        doubt = max(RATE_SHARE / share, 1.0)
        self.rate_low = rate * (1.0 - RATE_BELOW * doubt)
        self.rate_high = rate * (1.0 + RATE_ABOVE * doubt)
        return 0

    def _set_anchor(self):
        self.has_anchor = True
        self.anchor_temp = self.temp
        self.heat = self.above = 0.0
        return 0
