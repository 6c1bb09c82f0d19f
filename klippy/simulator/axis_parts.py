# SPDX-License-Identifier: GPL-3.0-or-later
"""Steppers, switches and how they are read from the config, for all kinds.

An end switch closes when its carriage stands at position_endstop or beyond.
"""
import math
import re
from dataclasses import dataclass, field

from klippy.errors import ConfigError
from klippy.simulator import settings

LINEAR_START = 0.35


@dataclass
class Stepper:
    """A stepper section: its step length in mm (radians) and its switch, if any."""

    name: str
    step_dist: float
    step_pin: str
    dir_pin: str
    endstop_pin: str | None


@dataclass
class Switch:
    """A switch that closes at a position of a sum of motors (in steps)."""

    pin: str
    coefficients: dict
    threshold: float
    is_above: bool


@dataclass
class Axes:
    """All steppers and switches of a machine.

    start: {axis or tower letter: mm} at power-up.
    mixes: {letter: {stepper name: mm per step}}.
    """

    kinematics: str
    steppers: list
    switches: list = field(default_factory=list)
    start: dict = field(default_factory=dict)
    mixes: dict = field(default_factory=dict)
    is_known: bool = True

    def calc_carriages(self, counts):
        """{letter: mm} of the carriages from {stepper name: steps}."""
        return {letter: self.start[letter] + sum(
                    factor * counts.get(name, 0)
                    for name, factor in mix.items())
                for letter, mix in self.mixes.items()}


def calc_step_dist(section):
    """mm (radians, with gears only) a microstep.  Raises ConfigError."""
    steps = _read_positive(section, "full_steps_per_rotation", 200)
    steps *= _read_positive(section, "microsteps")
    for part in (section.get("gear_ratio") or "").split(","):
        if part.strip():
            steps *= _parse_ratio(section, part)
    if (section.get("rotation_distance") is None
            and section.get("gear_ratio") is not None):
        return 2.0 * math.pi / steps
    return _read_positive(section, "rotation_distance") / steps


def _read_positive(section, option, default=settings.REQUIRED):
    value = section.getfloat(option, default)
    if not (value > 0.0 and math.isfinite(value)):
        raise ConfigError("Option '%s' in section '%s' must be a finite number above"
                          " 0, not '%s'" % (option, section.name, section.get(option)))
    return value


def _parse_ratio(section, text):
    """Rotations of the motor for one of the axis, of one pair of gears."""
    try:
        driven, driving = (float(word) for word in text.split(":"))
    except ValueError as e:
        raise ConfigError("Option 'gear_ratio' in section '%s' should be like 80:20,"
                          " not '%s'" % (section.name, text.strip())) from e
    if not (0.0 < driven < math.inf and 0.0 < driving < math.inf):
        raise ConfigError(
            "Option 'gear_ratio' in section '%s': '%s' must be two finite numbers"
            " above 0" % (section.name, text.strip()))
    return driven / driving


def read_stepper(section):
    """Stepper of a section with a step_pin."""
    return Stepper(section.name, calc_step_dist(section),
                   section.get("step_pin"), section.get("dir_pin"),
                   section.get("endstop_pin"))


def list_stepper_sections(config):
    """Sections with a step_pin, in the order of the config."""
    # Sections that borrow another one's geometry (towers of a delta,
    # second motors of an axis) are completed before they are read.
    found = []
    for section in config.sections.values():
        if section.get("step_pin") is None:
            continue
        base = config.get(_base_name(config, section.name))
        for option in ("rotation_distance", "microsteps", "gear_ratio",
                       "full_steps_per_rotation"):
            if section.get(option) is None and base.get(option) is not None:
                section.options[option] = base.get(option)
        found.append(section)
    return found


def _base_name(config, name):
    match = re.fullmatch(r"(stepper_[a-z]+)\d+", name)
    if match:
        return match[1]
    if name in ("stepper_b", "stepper_c"):
        return "stepper_a"
    return name


def find_family(axes, letter):
    """Steppers of an axis: stepper_z, stepper_z1, ..."""
    pattern = re.compile(r"stepper_%s\d*" % letter)
    return [s for s in axes.steppers if pattern.fullmatch(s.name)]


def homes_positive(section):
    """Whether an axis homes towards its greater positions."""
    choice = section.get("homing_positive_dir")
    if choice is not None:
        return section.getboolean("homing_positive_dir")
    low = section.getfloat("position_min", 0.0)
    high = section.getfloat("position_max")
    endstop = section.getfloat("position_endstop", low)
    return endstop > 0.5 * (low + high)


def to_mm(axes, factors):
    """{stepper name: mm a step} of motors with these weights."""
    lengths = {s.name: s.step_dist for s in axes.steppers}
    return {name: factor * lengths[name] for name, factor in factors.items()
            if name in lengths}


def _read_endstop(config, section):
    """Position in mm where the switch of an axis closes, or None."""
    pin = section.get("endstop_pin")
    if pin is not None and pin.endswith("z_virtual_endstop"):
        return config.get("probe").getfloat("z_offset", 0.0)
    if section.get("position_endstop") is None:
        return None
    return section.getfloat("position_endstop")


def place_axis(config, axes, letter, section, wanted):
    """Put an axis where it starts; wanted: mm, or None."""
    low = section.getfloat("position_min", 0.0)
    high = section.getfloat("position_max", 200.0)
    endstop = _read_endstop(config, section)
    if endstop is None:
        endstop = low
    if wanted is None:
        wanted = endstop + LINEAR_START * (
            (low if homes_positive(section) else high) - endstop)
    step = min(abs(mm) for mm in axes.mixes[letter].values())
    axes.start[letter] = endstop + round((wanted - endstop) / step) * step


def add_switch(config, axes, letter, section, stepper, factors):
    """Add the end switch of a stepper, if it has one."""
    pin, endstop = stepper.endstop_pin, _read_endstop(config, section)
    if pin is None or endstop is None:
        return
    if pin.endswith("z_virtual_endstop"):
        pin = config.get("probe").get("pin")
    is_above = homes_positive(section)
    append_switch(axes, pin, factors, endstop - axes.start[letter], is_above)


def append_switch(axes, pin, factors, distance, is_above):
    """Close `pin` once the sum of factors has gone `distance` mm.

    The threshold lies half a step before that, so that rounding cannot
    move the step that closes the switch.
    """
    half = 0.5 * min(abs(mm) for mm in factors.values())
    threshold = distance - half if is_above else distance + half
    axes.switches.append(Switch(pin, factors, threshold, is_above))


def add_axis(config, axes, letter, wanted=None):
    """Add an axis whose motors move nothing else: stepper_z, stepper_z1, ..."""
    section = config.get("stepper_" + letter)
    family = find_family(axes, letter)
    if not family:
        return
    axes.mixes[letter] = to_mm(axes, {section.name: 1.0})
    place_axis(config, axes, letter, section, wanted)
    for stepper in family:
        add_switch(config, axes, letter, section, stepper,
                   to_mm(axes, {stepper.name: 1.0}))
