# SPDX-License-Identifier: GPL-3.0-or-later
"""Axes: how counted steps move carriages, and where switches close.

Everything is derived from the stepper sections.  An end switch closes
when its carriage stands at position_endstop or beyond.  Before homing
nobody knows where the machine stands; it starts inside its volume, on a
whole number of steps from every switch.
"""
import math
import re
from dataclasses import dataclass, field

from klippy.errors import ConfigError
from klippy.simulator import settings

# Carriage position as a sum of motor positions, by kinematics:
# {axis: {motor: factor}}; motors not named move their own axis.
LINEAR_MIXES = {
    "cartesian": {},
    "corexy": {"x": {"x": 0.5, "y": 0.5}, "y": {"x": 0.5, "y": -0.5}},
    "corexz": {"x": {"x": 0.5, "z": 0.5}, "z": {"x": 0.5, "z": -0.5}},
    "hybrid_corexy": {"x": {"x": 1.0, "y": 1.0}},
    "hybrid_corexz": {"x": {"x": 1.0, "z": 1.0}},
}
# Start height above the bed of a delta, as a share of its height.
DELTA_START = 0.7
LINEAR_START = 0.35


@dataclass
class Stepper:
    """A stepper section: its step length in mm and its switch, if any."""

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
    """mm a microstep of a stepper section.  Raises ConfigError."""
    steps = _read_positive(section, "full_steps_per_rotation", 200)
    steps *= _read_positive(section, "microsteps")
    for part in (section.get("gear_ratio") or "").split(","):
        if part.strip():
            steps *= _parse_ratio(section, part)
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


def build_axes(config, start_position=None):
    """Axes of a MachineConfig; start_position: (x, y, z) or None."""
    kinematics = config.get("printer").get("kinematics") or "none"
    steppers = [read_stepper(s) for s in _list_stepper_sections(config)]
    axes = Axes(kinematics, steppers)
    if kinematics in LINEAR_MIXES:
        _build_linear(config, axes, start_position)
    elif kinematics == "delta":
        _build_delta(config, axes, start_position)
    else:
        axes.is_known = kinematics == "none"
    return axes


def _list_stepper_sections(config):
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


def _family(axes, letter):
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


def _build_linear(config, axes, start_position):
    mixes = LINEAR_MIXES[axes.kinematics]
    for index, letter in enumerate("xyz"):
        section = config.get("stepper_" + letter)
        family = _family(axes, letter)
        if not family:
            continue
        motors = mixes.get(letter, {letter: 1.0})
        main = {"stepper_" + motor: factor for motor, factor in motors.items()}
        axes.mixes[letter] = _to_mm(axes, main)
        wanted = start_position[index] if start_position else None
        _place_axis(config, axes, letter, section, wanted)
        for stepper in family:
            own = axes.mixes[letter]
            if len(main) == 1:
                own = _to_mm(axes, {stepper.name: next(iter(main.values()))})
            _add_switch(config, axes, letter, section, stepper, own)


def _to_mm(axes, factors):
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


def _place_axis(config, axes, letter, section, wanted):
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


def _add_switch(config, axes, letter, section, stepper, factors):
    pin, endstop = stepper.endstop_pin, _read_endstop(config, section)
    if pin is None or endstop is None:
        return
    if pin.endswith("z_virtual_endstop"):
        pin = config.get("probe").get("pin")
    is_above = homes_positive(section)
    _append_switch(axes, pin, factors, endstop - axes.start[letter], is_above)


def _append_switch(axes, pin, factors, distance, is_above):
    """Close `pin` once the sum of factors has gone `distance` mm.

    The threshold lies half a step before that, so that rounding cannot
    move the step that closes the switch.
    """
    half = 0.5 * min(abs(mm) for mm in factors.values())
    threshold = distance - half if is_above else distance + half
    axes.switches.append(Switch(pin, factors, threshold, is_above))


def _build_delta(config, axes, start_position):
    base = config.get("stepper_a")
    top = base.getfloat("position_endstop")
    low = config.get("printer").getfloat("minimum_z_position", 0.0)
    wanted = start_position[2] if start_position else None
    if wanted is None:
        wanted = low + DELTA_START * (top - low)
    for letter in "abc":
        section = config.get("stepper_" + letter)
        endstop = section.getfloat("position_endstop", top)
        factors = _to_mm(axes, {section.name: 1.0})
        if not factors:
            continue
        step = min(factors.values())
        travel = round((endstop - wanted) / step) * step
        axes.mixes[letter] = factors
        axes.start[letter] = endstop - travel
        _append_switch(axes, section.get("endstop_pin"), factors, travel, True)


def calc_delta_point(config, heights):
    """(x, y, z) of a delta's nozzle from {tower letter: carriage mm}.

    heights count like axes.start: a carriage at h carries a nozzle that
    stands at z = h when it is in the middle.
    """
    radius = config.get("printer").getfloat("delta_radius")
    arm = config.get("stepper_a").getfloat("arm_length")
    spheres = []
    for letter, angle in zip("abc", (210.0, 330.0, 90.0), strict=True):
        section = config.get("stepper_" + letter)
        angle = math.radians(section.getfloat("angle", angle))
        own_arm = section.getfloat("arm_length", arm)
        reach = own_arm ** 2 - radius ** 2
        if reach <= 0.0:
            raise ConfigError(
                "Option 'arm_length' in section '%s' must be above"
                " delta_radius %.3f, not %.3f"
                % (section.name, radius, own_arm))
        spheres.append((radius * math.cos(angle), radius * math.sin(angle),
                        heights[letter] + math.sqrt(reach), own_arm))
    return _intersect(spheres)


def _intersect(spheres):
    """Lower intersection of three spheres (x, y, z, radius)."""
    (x1, y1, z1, r1), second, third = spheres
    rows = []
    for x, y, z, r in (second, third):
        dx, dy, dz = x - x1, y - y1, z - z1
        rows.append((dx, dy, dz,
                     0.5 * (r1 * r1 - r * r + dx * dx + dy * dy + dz * dz)))
    (a1, b1, c1, d1), (a2, b2, c2, d2) = rows
    det = a1 * b2 - a2 * b1
    # x = p - q*z and y = s - t*z relative to the first sphere.
    p, q = (d1 * b2 - d2 * b1) / det, (c1 * b2 - c2 * b1) / det
    s, t = (a1 * d2 - a2 * d1) / det, (a1 * c2 - a2 * c1) / det
    a, b = 1.0 + q * q + t * t, p * q + s * t
    z = (b - math.sqrt(b * b - a * (p * p + s * s - r1 * r1))) / a
    return x1 + p - q * z, y1 + s - t * z, z1 + z
