# SPDX-License-Identifier: GPL-3.0-or-later
"""All that watches one heater, reading by reading: balance, stall and probe.

What a fault is called, and which of three questions finds it:
    heat_watch.HeatWatch   can the power have done that?  (learns the heater)
    heat_stall.StallWatch  may it stand still now?  (needs nothing learned)
    heat_probe.HeatProbe   does the reading follow at all?  (moves the power)
"""
from klippy.extras import heat_probe, heat_stall, heat_watch

KINDS = {
    "extruder": (heat_watch.EXTRUDER, heat_stall.EXTRUDER, heat_probe.EXTRUDER),
    "heater_bed": (heat_watch.BED, heat_stall.BED, heat_probe.BED),
    "other": (heat_watch.OTHER, heat_stall.OTHER, heat_probe.OTHER)}
# Faults that update() returns; those of the three have other numbers
NONE, TOO_WARM, TOO_COLD, NO_ANSWER, JUMPS, DEAD = range(6)


class HeatGuard:
    """Watches one heater; `offset` is to be added to the duty of its control."""

    def __init__(self, watch, stall, probe):
        self.watch, self.stall, self.probe = watch, stall, probe
        self.offset = 0.0

    def restart(self):
        """Forget the last minutes (not what was learned): power is unknown."""
        self.watch.restart()
        self.stall.restart()
        self.probe.restart()
        self.offset = 0.0
        return 0

    def update(self, elapsed, temp, target, duty, fan, flow):
        """Take a reading `elapsed` s after the one before; the fault or NONE.

        target: degC.  duty: 0..1 since then.  fan: 0..1.  flow: duty a degree
        (1/K) that filament may take at most.
        """
        watch = self.watch
        code = watch.update(elapsed, temp, target, duty, fan, flow)
        if watch.is_fresh:
            self.stall.restart()
            self.probe.restart()
        elif not code:
            code = self.stall.update(
                elapsed, watch.temp, watch.change, duty, watch.temp - watch.room,
                watch.fan_range, flow)
            if not code:
                rate = watch.rate if watch.rate > 0.0 else self.stall.steepest
                code = self.probe.update(elapsed, temp, target, duty, rate)
        self.offset = self.probe.offset
        return code


def make_guard(kind):
    """A HeatGuard for an `extruder`, a `heater_bed` or an `other` heater."""
    watch, stall, probe = KINDS[kind]
    return HeatGuard(heat_watch.HeatWatch(watch), heat_stall.StallWatch(stall),
                     heat_probe.HeatProbe(probe))
