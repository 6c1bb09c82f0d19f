# SPDX-License-Identifier: GPL-3.0-or-later
"""Cartesian machines with limits of x and y on their own."""

from klippy.kinematics import cartesian
from klippy.kinematics.axis_limits import LimitedAxes
from klippy.kinematics.dual_linear import DualLinearMachine


class LimitedCartesian(LimitedAxes, cartesian.CartKinematics):
    """One rail an axis."""


class LimitedDualCartesian(LimitedAxes, DualLinearMachine):
    """Two carriages on x or on y."""


def load_kinematics(toolhead, config):
    if config.has_section("dual_carriage"):
        machine = LimitedDualCartesian(toolhead, config, cartesian.WEIGHTS,
                                       cartesian.DUAL_WEIGHTS)
    else:
        machine = LimitedCartesian(toolhead, config)
    machine.limit_axes(toolhead, config)
    return machine
