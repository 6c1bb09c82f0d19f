# SPDX-License-Identifier: GPL-3.0-or-later
"""CoreXZ machines with limits of x and y on their own."""

from klippy.kinematics.axis_limits import LimitedAxes
from klippy.kinematics.corexz import CoreXZKinematics


class LimitedCoreXZ(LimitedAxes, CoreXZKinematics):
    """A CoreXZ machine that spares its axes."""


def load_kinematics(toolhead, config):
    machine = LimitedCoreXZ(toolhead, config)
    machine.limit_axes(toolhead, config)
    return machine
