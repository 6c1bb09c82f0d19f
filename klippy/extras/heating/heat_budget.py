# SPDX-License-Identifier: GPL-3.0-or-later
"""How hot may the block be behind its reading?  Bounds the energy it is given.

`hot` is the hottest that the block is likely to be: all power since the reading
was last known to be right, less the losses, never below the reading itself.
Where it passes a limit the power is cut until the reading shows that it follows:
it must fall below its highest since then.  A live sensor does, and costs a dip
of some degrees.  One that is stuck, or far behind, does not.

Nothing is decided by what the power looks like, so that a draft, a weak supply
or a cold plate cost at most a dip.  A reading that follows, but is wrong by a
slowly growing offset, is not found here.
"""
from klippy.record import record

# Faults that update() returns
NONE, TOO_COLD, DEAD = 0, 2, 5

# Of filament's largest share of power (as of a 25 W heater) what a strong one feels
FLOW_SHARE = 0.3
# More than what was learned, as of a supply that was weak then
STRONGER = 1.2
# s over which a reading's latest slope is taken
LATEST = 2.0
# Share of power that losses take at most where they are not known
MOST_LOSSES = 0.9
# Of the power that a target needed at first, what it may need in a draft with a
# weak supply; degC.s below the target under the ceiling that are a fault
MOST_NEED, MAX_LACK, LACK_BEGINS = 1.4, 3000.0, 4.0


@record(frozen=True)
class BudgetTraits:
    """What a cut waits for.

    fall: degC that the reading must fall by.  patience: s until it must have.
    slope_time: s over which the slope before a cut is taken.  margin: degC below
    max_temp that the limit lies where the target is lower than it by `room`.
    """

    fall: float
    patience: float
    slope_time: float
    margin: float
    room: float


EXTRUDER = BudgetTraits(3.0, 120.0, 10.0, 30.0, 16.0)
BED = BudgetTraits(2.0, 900.0, 60.0, 5.0, 15.0)
OTHER = BudgetTraits(2.0, 900.0, 60.0, 5.0, 15.0)


class HeatBudget:
    """Watches one heater; while `is_cut` its power is to be 0."""

    def __init__(self, traits, max_temp):
        """max_temp: degC of the heater's section."""
        self.fall, self.patience = traits.fall, traits.patience
        self.slope_time = traits.slope_time
        self.max_temp = max_temp
        self.margin, self.room = traits.margin, traits.room
        self.n_cuts = 0
        self.last = 0.0
        self.restart()

    def restart(self):
        """Begin at the next reading: what the power was is not known."""
        self.is_new = True
        self.is_cut = self.is_under = False
        self.open = self.lack = 0.0
        self.latest = 0.0
        self.hot = self.slope = self.peak = self.cut_time = self.before = 0.0
        return 0

    def trust(self, temp):
        """The reading (degC) is known to follow."""
        if not self.is_cut:
            self.hot = temp
        return 0

    def update(self, elapsed, temp, target, duty, rate, hold, room, flow):
        """Take a reading; DEAD or NONE.

        target: degC.  duty: 0..1 since the reading before.  rate: degC/s at full
        power, 0: not known.  hold: duty that a degree above the room (degC) needs.
        flow: duty a degree (1/K) that filament may take at most.
        """
        if self.is_new:
            self.is_new = False
            self.hot = self.last = temp
        change, self.last = temp - self.last, temp
        losses = (hold + FLOW_SHARE * flow) * max(self.hot - room, 0.0)
        self.hot += STRONGER * rate * (duty - losses) * elapsed
        if change > 0.0:
            # what did warm it is no margin for what might
            self.hot -= (1.0 - 1.0 / STRONGER) * change
        self.hot = max(self.hot, temp)
        if duty > 0.0:
            # the power that a cut ends may act for one more reading
            share = min(elapsed / self.slope_time, 1.0)
            self.slope += share * (change / elapsed - self.slope)
            share = min(elapsed / LATEST, 1.0)
            self.latest += share * (change / elapsed - self.latest)
            self.before = min(self.slope, self.latest, 0.0)
            self.peak, self.cut_time = temp, 0.0
        else:
            self._follow_fall(elapsed, temp)
        limit = min(max(self.max_temp - self.margin, target + self.room),
                    self.max_temp)
        if self.hot > limit and not self.is_cut:
            self.is_cut = True
            self.n_cuts += 1
        if self.is_cut and self.cut_time > self.patience:
            return DEAD
        return NONE

    def watch_ceiling(self, elapsed, temp, target, duty, rate, hold, room, flow):
        """Bound the mean power, whatever the reading says; TOO_COLD or NONE.

        hold: duty that a degree above the room needed at first; 0: not known.
        """
        if hold <= 0.0 or rate <= 0.0 or self.open <= 0.0:
            self.open = temp
            return NONE
        losses = (hold + flow) * max(self.open - room, 0.0)
        self.open = max(self.open + rate * (duty - losses) * elapsed, temp)
        limit = max(self.max_temp, room + MOST_NEED * (target - room))
        if self.open > limit:
            self.is_under = True
        elif self.open < limit - 1.0:
            self.is_under = False
            self.lack = max(self.lack - elapsed, 0.0)
        if self.is_under and target > 0.0:
            self.lack += max(target - LACK_BEGINS - temp, 0.0) * elapsed
        return TOO_COLD if self.lack > MAX_LACK else NONE

    def _follow_fall(self, elapsed, temp):
        """Without power: a reading that falls by more than it did anyhow is right."""
        self.cut_time += elapsed
        self.peak = max(self.peak + self.before * elapsed, temp)
        if temp > self.peak - self.fall:
            return 0
        self.peak = self.hot = temp
        self.is_cut = False
        return 0


def calc_hold(steepest, rise, above):
    """Duty a degree (1/K) that losses take, where full power makes it rise by `rise`.

    steepest: degC/s near the room.  above: degC over the room.
    """
    if steepest <= 0.0 or above <= 0.0:
        return 0.0
    return min(max(1.0 - rise / steepest, 0.0), MOST_LOSSES) / above
