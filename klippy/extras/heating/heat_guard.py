# SPDX-License-Identifier: GPL-3.0-or-later
"""All that watches one heater, reading by reading: balance, stall, probe, budget.

What a fault is called, and which of four questions finds it:
    heat_watch.HeatWatch   can the power have done that?  (learns the heater)
    heat_stall.StallWatch  may it stand still now?  (needs nothing learned)
    heat_probe.HeatProbe   does the reading follow at all?  (moves the power)
    heat_budget.HeatBudget  may the block be too hot by now?  (cuts the power)
"""
from klippy.extras import heat_budget, heat_probe, heat_stall, heat_watch

KINDS = {
    "extruder": (heat_watch.EXTRUDER, heat_stall.EXTRUDER, heat_probe.EXTRUDER,
                 heat_budget.EXTRUDER),
    "heater_bed": (heat_watch.BED, heat_stall.BED, heat_probe.BED, heat_budget.BED),
    "other": (heat_watch.OTHER, heat_stall.OTHER, heat_probe.OTHER,
              heat_budget.OTHER)}
# degC over its target from which a heater is not taken for one that is cut off
FAR_ABOVE = 15.0
# degC that the block may be above its reading before the probe asks at once
DOUBT = 12.0
# Faults that update() returns; those of the four have other numbers
NONE, TOO_WARM, TOO_COLD, NO_ANSWER, JUMPS, DEAD = range(6)


class HeatGuard:
    """Watches one heater; `offset` is to be added to the duty of its control, and
    no power to be given while `is_cut`."""

    def __init__(self, watch, stall, probe, budget):
        self.watch, self.stall, self.probe = watch, stall, probe
        self.budget = budget
        self.offset = 0.0
        self.is_cut = False

    def restart(self):
        """Forget the last minutes (not what was learned): power is unknown."""
        self.watch.restart()
        self._restart_others()
        self.offset = 0.0
        return 0

    def _restart_others(self):
        self.stall.restart()
        self.probe.restart()
        self.budget.restart()
        self.is_cut = False
        return 0

    def update(self, elapsed, temp, target, duty, fan, flow):
        """Take a reading `elapsed` s after the one before; the fault or NONE.

        target: degC.  duty: 0..1 since then.  fan: 0..1.  flow: duty a degree
        (1/K) that filament may take at most.
        """
        watch = self.watch
        code = watch.update(elapsed, temp, target, duty, fan, flow)
        if watch.is_fresh:
            self._restart_others()
        elif not code:
            code = self._ask_others(elapsed, temp, target, duty, flow)
        if self.is_cut and code == TOO_WARM and temp < target + FAR_ABOVE:
            # nothing heats: the reading stands where the power was cut
            code = DEAD
        self.offset = self.probe.offset
        return code

    def _ask_others(self, elapsed, temp, target, duty, flow):
        watch, stall = self.watch, self.stall
        above = watch.temp - watch.room
        rate, hold = watch.rate, watch.choose_hold(watch.fan_range)
        code = stall.update(elapsed, watch.temp, watch.change, duty, above,
                            watch.fan_range, flow, hold)
        watch.risen = stall.steepest
        if rate <= 0.0:
            rate = stall.steepest
        if hold <= 0.0:
            hold = heat_budget.calc_hold(
                stall.steepest, stall.find_rise(watch.temp), above)
        if not code:
            code = self.probe.update(elapsed, temp, target, duty, rate)
        if self.probe.is_alive:
            self.budget.trust(watch.temp)
        elif self.budget.hot > watch.temp + DOUBT:
            self.probe.hurry()
        if not code:
            code = self.budget.update(
                elapsed, watch.temp, target, duty, rate, hold, watch.room, flow)
        if not code:
            code = self.budget.watch_ceiling(
                elapsed, watch.temp, target, duty, rate,
                watch.find_reference(watch.fan_range), watch.room, flow)
        self.is_cut = self.budget.is_cut or self.budget.is_under
        return code


def make_guard(kind, max_temp):
    """A HeatGuard for an `extruder`, a `heater_bed` or an `other` heater.

    max_temp: degC of its section.
    """
    watch, stall, probe, budget = KINDS[kind]
    return HeatGuard(heat_watch.HeatWatch(watch), heat_stall.StallWatch(stall),
                     heat_probe.HeatProbe(probe),
                     heat_budget.HeatBudget(budget, max_temp))
