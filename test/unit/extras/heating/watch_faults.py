# SPDX-License-Identifier: GPL-3.0-or-later
"""One fault on one random machine: who sees it, when, how hot the block gets."""
from dataclasses import dataclass

import heat_world
from bench_printer import Printer

from klippy.extras import (
    heat_budget,
    heat_guard,
    heat_probe,
    heat_stall,
    heat_watch,
    verify_heater,
)

# Not compiled; or what compiled_world.load() gives
MODULES = (heat_world, heat_watch, heat_stall, heat_probe, heat_budget, heat_guard)
KINDS = ("extruder", "heater_bed")
MAX_TEMPS = {"extruder": 300.0, "heater_bed": 130.0}
MIN_TEMP = 0.0
CONTROLS = {"pid": heat_world.PID, "watermark": heat_world.WATERMARK,
            "mpc": heat_world.MODEL}
FAULTS = {
    "open heater": heat_world.OPEN_HEATER, "heater stuck on": heat_world.STUCK_ON,
    "sensor stuck": heat_world.STUCK_SENSOR,
    "sensor stuck 4 below": heat_world.STUCK_BELOW,
    "sensor fallen off": heat_world.FALLEN_OFF, "sensor slow": heat_world.SLOW_SENSOR,
    "sensor jumping": heat_world.JUMPING, "sensor 35 high": heat_world.SHIFTED_UP,
    "sensor 35 low": heat_world.SHIFTED_DOWN, "sensor drifting": heat_world.DRIFTING,
    "sensor creeping out": heat_world.CREEPING,
    "contact corroding": heat_world.CORRODING}
# When it happens: while holding a temperature, or the highest that it can, before
# heating up again, in the middle of that, before cooling down, or before heating to
# just above the room
MOMENTS = ("hold", "hot", "off", "climb", "cooling", "near room")
LONGEST = {"extruder": 1200.0, "heater_bed": 3600.0}
LEARN_TIME = {"extruder": 700.0, "heater_bed": 2400.0}


@dataclass
class Outcome:
    """by: what saw it (None: nothing).  seconds: after the fault.  hottest: degC.

    spoiled: s in which the block was not what the reading said.
    """

    by: str | None
    seconds: float
    hottest: float
    spoiled: float


class Bystander:
    """The world's heater as verify_heater sees it."""

    n_expired = 0

    def __init__(self, world):
        self.world = world

    @property
    def is_cut(self):
        return self.world.guard.is_cut

    @property
    def n_cuts(self):
        return self.world.guard.budget.n_cuts

    def lookup_heater(self, name):
        return self

    def get_temp(self, eventtime):
        return self.world.reading, self.world.target


def make_world(modules, kind_name, seed, control=None):
    """A random HeaterWorld with its watch; control: see CONTROLS."""
    world, watch, stall, probe, budget, guard = modules
    traits = "EXTRUDER" if kind_name == "extruder" else "BED"
    kind = world.HOTEND if kind_name == "extruder" else world.BED
    return world.HeaterWorld(
        kind, seed,
        guard.HeatGuard(watch.HeatWatch(getattr(watch, traits)),
                        stall.StallWatch(getattr(stall, traits)),
                        probe.HeatProbe(getattr(probe, traits)),
                        budget.HeatBudget(getattr(budget, traits), kind.max_temp)),
        None if control is None else CONTROLS[control])


def run_fault(modules, kind_name, fault, moment, seed, control=None):
    """Outcome of a fault in a machine that has printed before."""
    world = make_world(modules, kind_name, seed, control)
    kind = world.kind
    world.is_script = True
    world.fan = world.rng.choice((0.0, 0.5, 1.0))
    printer = Printer()
    printer.objects["heaters"] = Bystander(world)
    verify_heater.load_config_prefix(
        printer.make_section("verify_heater " + kind_name))
    printer.start()
    target = world.highest if moment == "hot" else 0.5 * (kind.low + world.highest)
    plan = [(0.0, 120.0), (target, LEARN_TIME[kind_name])]
    if moment not in ("hold", "hot"):
        plan.append((0.0, 600.0 if world.is_hotend else 2400.0))
    if moment in ("climb", "cooling"):
        plan.append((target, 12.0 if moment == "climb" else 400.0))
    for degrees, seconds in plan:
        world.target = degrees
        by = watch(world, printer, seconds)
        assert by is None, "false trip: %s, %s, seed %d" % (kind_name, by, seed)
    world.set_fault(FAULTS[fault])
    if moment == "cooling":
        world.target = 0.0
    elif moment == "near room":
        world.target = world.ambient + 8.0
    elif moment == "off":
        by = watch(world, printer, 120.0)
        world.target = target if by is None else 0.0
        if by is not None:
            return finish(world, by)
    by = watch(world, printer, LONGEST[kind_name])
    # the day goes on: it cools down, and heats for the next print
    for degrees in (0.0, target):
        if by is None:
            world.target = degrees
            by = watch(world, printer, LONGEST[kind_name])
    return finish(world, by)


def finish(world, by):
    return Outcome(by, world.now - world.fault_time, world.hottest, world.spoiled)


def watch(world, printer, seconds):
    """Let time pass second by second; who stopped the machine, or None."""
    end = world.now + seconds
    while world.now < end:
        code = world.run(1.0)
        if code:
            return ("", "too warm", "too cold", "no answer", "jumps", "dead")[code]
        printer.advance(1.0)
        if printer.is_shutdown():
            return "verify_heater"
        if not MIN_TEMP <= world.reading <= world.kind.max_temp:
            return "limits"
    return None
