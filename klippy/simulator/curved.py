# SPDX-License-Identifier: GPL-3.0-or-later
"""Machines whose carriages are no weighted sums of axes.

Each kind builds its Axes from the config and tells where the nozzle is, by
formulas of its own: the printer under test uses others.
"""
import math
from typing import NamedTuple

from klippy.errors import ConfigError
from klippy.simulator.axis_parts import add_axis, append_switch, to_mm

# Start height above the bed, as a share of what there is
DELTA_START = 0.7


def _choose_height(config, top, start_position):
    """Height (mm) at which a machine starts that homes upwards."""
    if start_position:
        return start_position[2]
    low = config.get("printer").getfloat("minimum_z_position", 0.0)
    return low + DELTA_START * (top - low)


def _add_column(config, axes, letter, top, height):
    """A carriage that homes up to position_endstop, `height` below a nozzle."""
    section = config.get("stepper_" + letter)
    endstop = section.getfloat("position_endstop", top)
    factors = to_mm(axes, {section.name: 1.0})
    if not factors:
        return
    step = min(factors.values())
    travel = round((endstop - height) / step) * step
    axes.mixes[letter] = factors
    axes.start[letter] = endstop - travel
    append_switch(axes, section.get("endstop_pin"), factors, travel, True)


def _build_delta(config, axes, start_position):
    top = config.get("stepper_a").getfloat("position_endstop")
    height = _choose_height(config, top, start_position)
    for letter in "abc":
        _add_column(config, axes, letter, top, height)


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


def _intersect(spheres, side=-1.0):
    """Lower (side 1.: upper) intersection of three spheres (x, y, z, radius)."""
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
    z = (b + side * math.sqrt(b * b - a * (p * p + s * s - r1 * r1))) / a
    return x1 + p - q * z, y1 + s - t * z, z1 + z


# Deltesians


def _build_deltesian(config, axes, start_position):
    top = config.get("stepper_left").getfloat("position_endstop")
    height = _choose_height(config, top, start_position)
    for letter in ("left", "right"):
        _add_column(config, axes, letter, top, height)
    add_axis(config, axes, "y", start_position[1] if start_position else None)


def calc_deltesian_point(config, heights):
    """(x, y, z); heights as with calc_delta_point()."""
    sides = []
    for letter, side in (("left", -1.0), ("right", 1.0)):
        section, base = config.get("stepper_" + letter), config.get("stepper_left")
        reach = section.getfloat("arm_x_length", base.getfloat("arm_x_length"))
        arm = section.getfloat("arm_length", base.getfloat("arm_length"))
        sides.append((side * reach, heights[letter]
                      + math.sqrt(arm ** 2 - reach ** 2), arm))
    (x1, z1, r1), (x2, z2, r2) = sides
    # the circles' common chord is x = p - q * z, relative to the first one
    dx, dz = x2 - x1, z2 - z1
    p, q = (r1 * r1 - r2 * r2 + dx * dx + dz * dz) / (2.0 * dx), dz / dx
    a, b = 1.0 + q * q, p * q
    z = (b - math.sqrt(b * b - a * (p * p - r1 * r1))) / a
    return x1 + p - q * z, heights["y"], z1 + z


# Rotary deltas


def _list_arms(config):
    """(letter, direction, upper arm, lower arm) of each arm; radians, mm."""
    base, arms = config.get("stepper_a"), []
    for letter, angle in zip("abc", (30.0, 150.0, 270.0), strict=True):
        section = config.get("stepper_" + letter)
        arms.append((letter, math.radians(section.getfloat("angle", angle)), *(
            section.getfloat(option, base.getfloat(option))
            for option in ("upper_arm_length", "lower_arm_length"))))
    return arms


def _find_angle(config, upper, lower, z):
    """Angle of an upper arm for a nozzle in the middle at height z.

    By halving: the higher the elbow, the longer the way to the nozzle.
    """
    printer = config.get("printer")
    radius, height = (printer.getfloat(option) for option in
                      ("shoulder_radius", "shoulder_height"))
    low = math.atan2(z - height, -radius) % (2.0 * math.pi) - 2.0 * math.pi
    high = low + math.pi
    for _ in range(80):
        middle = 0.5 * (low + high)
        far = math.hypot(radius + upper * math.cos(middle),
                         height + upper * math.sin(middle) - z)
        low, high = (low, middle) if far > lower else (middle, high)
    return low


def _build_rotary_delta(config, axes, start_position):
    top = config.get("stepper_a").getfloat("position_endstop")
    z = _choose_height(config, top, start_position)
    for letter, _, upper, lower in _list_arms(config):
        section = config.get("stepper_" + letter)
        factors = to_mm(axes, {section.name: 1.0})
        if not factors:
            continue
        end = _find_angle(config, upper, lower,
                          section.getfloat("position_endstop", top))
        step = min(factors.values())
        travel = round((end - _find_angle(config, upper, lower, z)) / step) * step
        axes.mixes[letter] = factors
        axes.start[letter] = end - travel
        append_switch(axes, section.get("endstop_pin"), factors, travel, True)


def calc_rotary_delta_point(config, angles):
    """(x, y, z) for {letter: angle of the upper arm}, radians."""
    printer, spheres = config.get("printer"), []
    for letter, direction, upper, lower in _list_arms(config):
        out = (printer.getfloat("shoulder_radius")
               + upper * math.cos(angles[letter]))
        spheres.append((
            out * math.cos(direction), out * math.sin(direction),
            printer.getfloat("shoulder_height") + upper * math.sin(angles[letter]),
            lower))
    return _intersect(spheres)


# Polar machines


def _build_polar(config, axes, start_position):
    axes.mixes["bed"] = to_mm(axes, {"stepper_bed": 1.0})
    axes.start["bed"] = 0.0
    add_axis(config, axes, "arm")
    add_axis(config, axes, "z", start_position[2] if start_position else None)


def calc_polar_point(config, carriages):
    """(x, y, z); the bed stands at angle 0 when it is switched on."""
    return (carriages["arm"] * math.cos(carriages["bed"]),
            carriages["arm"] * math.sin(carriages["bed"]), carriages["z"])


# Winches


def _list_anchors(config):
    return {section.name.removeprefix("stepper_"): tuple(
                section.getfloat("anchor_" + axis) for axis in "xyz")
            for section in config.sections.values()
            if section.get("anchor_x") is not None}


def _build_winch(config, axes, start_position):
    start = tuple(start_position or (0.0, 0.0, 0.0))
    for letter, anchor in _list_anchors(config).items():
        axes.mixes[letter] = to_mm(axes, {"stepper_" + letter: 1.0})
        axes.start[letter] = math.dist(anchor, start)


def calc_winch_point(config, lengths):
    """(x, y, z) at which the cables of three anchors meet, near the origin."""
    anchors = _list_anchors(config)
    chosen = [(*anchors[letter], lengths[letter]) for letter in sorted(anchors)[:3]]
    points = [_intersect(chosen), _intersect(chosen, 1.0)]
    return min(points, key=lambda point: sum(
        abs(math.dist(point, anchors[letter]) - lengths[letter])
        for letter in anchors) + 1e-9 * math.hypot(*point))


class Kind(NamedTuple):
    """What there is of a kind: build(config, axes, start_position) and
    calc_point(config, carriages)."""

    build: object
    calc_point: object


KINDS = {"delta": Kind(_build_delta, calc_delta_point),
         "deltesian": Kind(_build_deltesian, calc_deltesian_point),
         "polar": Kind(_build_polar, calc_polar_point),
         "rotary_delta": Kind(_build_rotary_delta, calc_rotary_delta_point),
         "winch": Kind(_build_winch, calc_winch_point)}
