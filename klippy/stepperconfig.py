# SPDX-License-Identifier: GPL-3.0-or-later
"""Options that tell how far a motor moves its axis a step.

All positions are mm, or radians for an axis that turns.
"""

import math

FULL_STEPS = 200
# Driver tables repeat after four full steps
CYCLE_STEPS = 4


def parse_gear_ratio(config, note_valid=True):
    """Rotations of the motor for one of the axis (1 without gears).

    Raises ConfigError for a gear without teeth.
    """
    pairs = config.getlists("gear_ratio", (), seps=(":", ","), count=2,
                            parser=float, note_valid=note_valid)
    ratio = 1.
    for driven, driving in pairs:
        if not (driven > 0. and driving > 0.):
            raise config.error(
                "Option 'gear_ratio' in section '%s': '%g:%g' must be two numbers"
                " above 0" % (config.get_name(), driven, driving))
        ratio *= driven / driving
    return ratio


def is_turning(config):
    """True if a section has gears only: its axis is one of angles."""
    return (config.get("rotation_distance", None, note_valid=False) is None
            and config.get("gear_ratio", None, note_valid=False) is not None)


def parse_step_distance(config, units_in_radians=None, note_valid=False):
    """(way of the axis for one turn of its last gear, steps for that turn).

    units_in_radians: the axis turns; None: found from the options.
    Raises ConfigError.
    """
    if units_in_radians is None:
        units_in_radians = is_turning(config)
    if units_in_radians:
        rotation_dist = 2. * math.pi
        # an axis of angles has gears, if only 1:1
        config.get("gear_ratio", note_valid=note_valid)
    else:
        rotation_dist = config.getfloat("rotation_distance", above=0.,
                                        note_valid=note_valid)
    microsteps = config.getint("microsteps", minval=1, note_valid=note_valid)
    full_steps = config.getint("full_steps_per_rotation", FULL_STEPS, minval=1,
                               note_valid=note_valid)
    if full_steps % CYCLE_STEPS:
        raise config.error(
            "Option 'full_steps_per_rotation' in section '%s': '%d' must be a"
            " multiple of %d" % (config.get_name(), full_steps, CYCLE_STEPS))
    return rotation_dist, (full_steps * microsteps
                           * parse_gear_ratio(config, note_valid))
