# SPDX-License-Identifier: GPL-3.0-or-later
"""Machines of generic carriages: which sums of motors move which carriage."""
import re

from klippy.errors import ConfigError
from klippy.simulator.axis_parts import append_switch, homes_positive, place_axis, to_mm


def _read_weights(section):
    """{carriage: weight} of the option `carriages` of a motor."""
    weights = {}
    for term in re.findall(r"[+-]?[^+-]+", section.get("carriages", "")):
        sign = -1.0 if term.strip().startswith("-") else 1.0
        *factor, name = (part.strip(" +-") for part in term.split("*"))
        try:
            weight = sign * (float(factor[0]) if factor else 1.0)
        except ValueError as e:
            raise ConfigError(
                "Option 'carriages' in section '%s' should be like x+y, not '%s'"
                % (section.name, section.get("carriages"))) from e
        weights[name] = weights.get(name, 0.0) + weight
    return weights


def _list_named(config, kind):
    """{name: section} of the sections [kind name]."""
    return {name.split(None, 1)[1]: section
            for name, section in config.sections.items()
            if name.split(None, 1)[0] == kind and " " in name}


def build(config, axes, start_position):
    """Place all carriages and their switches; extra ones move with their main."""
    mains = {**_list_named(config, "carriage"), **_list_named(config, "dual_carriage")}
    extras = _list_named(config, "extra_carriage")
    leaders = {name: name for name in mains}
    leaders.update((name, s.get("primary_carriage")) for name, s in extras.items())
    motors = {s.name: _read_weights(s) for s in _list_named(config, "stepper").values()}
    shares = _find_shares(motors, leaders, list(mains))
    for name, section in mains.items():
        axes.mixes[name] = to_mm(axes, shares[name])
        if not axes.mixes[name]:
            continue
        index = "xyz".find(name)
        wanted = start_position[index] if start_position and index >= 0 else None
        place_axis(config, axes, name, section, wanted)
        distance = section.getfloat("position_endstop") - axes.start[name]
        for pin in [section.get("endstop_pin"), *(
                s.get("endstop_pin") for extra, s in extras.items()
                if leaders[extra] == name)]:
            append_switch(axes, pin, axes.mixes[name], distance,
                          homes_positive(section))


def _find_shares(motors, leaders, names):
    """{carriage: {motor: factor}}: carriages by motors, by least squares."""
    import numpy as np
    table = np.zeros((len(motors), len(names)))
    for row, weights in zip(table, motors.values(), strict=True):
        for name, weight in weights.items():
            if leaders.get(name) in names:
                row[names.index(leaders[name])] += weight
    return {name: {motor: factor for motor, factor in zip(motors, row, strict=True)
                   if abs(factor) > 1e-9}
            for name, row in zip(names, np.linalg.pinv(table), strict=True)}
