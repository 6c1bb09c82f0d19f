# SPDX-License-Identifier: GPL-3.0-or-later
"""CoreXY machines with limits of x and y on their own."""

from klippy.kinematics.axis_limits import LimitedAxes
from klippy.kinematics.corexy import CoreXYKinematics


class LimitedCoreXY(LimitedAxes, CoreXYKinematics):
    """A CoreXY machine; both of its motors share the force of x and y."""


def load_kinematics(toolhead, config):
    machine = LimitedCoreXY(toolhead, config)
    machine.limit_axes(toolhead, config, are_motors_shared=True)
    return machine
