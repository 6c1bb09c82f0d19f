# SPDX-License-Identifier: GPL-3.0-or-later
"""Axes: how counted steps move carriages, and where switches close.

Everything is derived from the stepper sections.  An end switch closes
when its carriage stands at position_endstop or beyond.  Before homing
nobody knows where the machine stands; it starts inside its volume, on a
whole number of steps from every switch.
"""
from klippy.simulator import carriages, curved
from klippy.simulator.axis_parts import (
    Axes,
    add_switch,
    calc_step_dist,
    find_family,
    list_stepper_sections,
    place_axis,
    read_stepper,
    to_mm,
)

__all__ = ["Axes", "build_axes", "calc_point", "calc_step_dist"]

# Carriage position as a sum of motor positions, by kinematics:
# {axis: {motor: factor}}; motors not named move their own axis.
LINEAR_MIXES = {
    "cartesian": {},
    "corexy": {"x": {"x": 0.5, "y": 0.5}, "y": {"x": 0.5, "y": -0.5}},
    "corexz": {"x": {"x": 0.5, "z": 0.5}, "z": {"x": 0.5, "z": -0.5}},
    "hybrid_corexy": {"x": {"x": 1.0, "y": 1.0}},
    "hybrid_corexz": {"x": {"x": 1.0, "z": 1.0}},
    "hybrid_corexy inverted": {"x": {"x": 1.0, "y": -1.0}},
    "hybrid_corexz inverted": {"x": {"x": 1.0, "z": -1.0}},
}


def build_axes(config, start_position=None):
    """Axes of a MachineConfig; start_position: (x, y, z) or None."""
    kinematics = config.get("printer").get("kinematics") or "none"
    # Limits of x and y alone do not change what motors do
    kinematics = kinematics.removeprefix("limited_")
    if (kinematics.startswith("hybrid_")
            and config.get("printer").getboolean("invert_kinematics", False)):
        kinematics += " inverted"
    steppers = [read_stepper(s) for s in list_stepper_sections(config)]
    axes = Axes(kinematics, steppers)
    if kinematics in LINEAR_MIXES:
        _build_linear(config, axes, start_position)
        _build_dual(config, axes)
    elif kinematics == "generic_cartesian":
        carriages.build(config, axes, start_position)
    elif kinematics in curved.KINDS:
        curved.KINDS[kinematics].build(config, axes, start_position)
    else:
        axes.is_known = kinematics == "none"
    _build_manual(config, axes)
    return axes


def calc_point(config, axes, counts):
    """(x, y, z) mm of the nozzle for {stepper name: steps}; None if unknown."""
    places = axes.calc_carriages(counts)
    if axes.kinematics in curved.KINDS:
        return curved.KINDS[axes.kinematics].calc_point(config, places)
    if not axes.is_known or not set(places) >= set("xyz"):
        return None
    return tuple(places[letter] for letter in "xyz")


def _build_linear(config, axes, start_position):
    mixes = LINEAR_MIXES[axes.kinematics]
    for index, letter in enumerate("xyz"):
        section = config.get("stepper_" + letter)
        family = find_family(axes, letter)
        if not family:
            continue
        motors = mixes.get(letter, {letter: 1.0})
        main = {"stepper_" + motor: factor for motor, factor in motors.items()}
        axes.mixes[letter] = to_mm(axes, main)
        wanted = start_position[index] if start_position else None
        place_axis(config, axes, letter, section, wanted)
        for stepper in family:
            own = axes.mixes[letter]
            if len(main) == 1:
                own = to_mm(axes, {stepper.name: next(iter(main.values()))})
            add_switch(config, axes, letter, section, stepper, own)


def _build_dual(config, axes):
    """The second carriage: its motors, with what it shares with other axes."""
    section = config.get("dual_carriage")
    if section.get("step_pin") is None:
        return
    # a hybrid's second belt runs the other way
    axis = section.get("axis", "x")
    mix = {"stepper_" + motor: -factor for motor, factor in
           LINEAR_MIXES[axes.kinematics].get(axis, {}).items() if motor != axis}
    axes.mixes["dual_carriage"] = to_mm(axes, {"dual_carriage": 1.0, **mix})
    place_axis(config, axes, "dual_carriage", section, None)
    stepper = next(s for s in axes.steppers if s.name == "dual_carriage")
    add_switch(config, axes, "dual_carriage", section, stepper,
               axes.mixes["dual_carriage"])


def _build_manual(config, axes):
    """Motors of [manual_stepper]s that have a switch, each on a rail of its own.

    The switch is at the lower end, unless homing_positive_dir says otherwise.
    """
    for stepper in axes.steppers:
        if (not stepper.name.startswith("manual_stepper ")
                or stepper.endstop_pin is None):
            continue
        section = config.get(stepper.name)
        section.options.setdefault("position_endstop", "0")
        section.options.setdefault("homing_positive_dir", "false")
        axes.mixes[stepper.name] = to_mm(axes, {stepper.name: 1.0})
        place_axis(config, axes, stepper.name, section, None)
        add_switch(config, axes, stepper.name, section, stepper,
                   axes.mixes[stepper.name])
