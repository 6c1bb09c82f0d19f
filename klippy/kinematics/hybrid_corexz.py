# SPDX-License-Identifier: GPL-3.0-or-later
"""Hybrid corexz machines: the belt of x runs along with z."""

from klippy.kinematics.dual_linear import DualLinearMachine
from klippy.kinematics.linear import LinearMachine

WEIGHTS = ((1., 0., -1.), (0., 1., 0.), (0., 0., 1.))
# Of the motor of a second carriage on x, whose belt runs the other way
DUAL_WEIGHTS = {0: (1., 0., 1.)}


class HybridCoreXZKinematics(LinearMachine):
    """stepper_z moves z alone; stepper_x moves x and makes up for z."""

    def __init__(self, toolhead, config):
        super().__init__(toolhead, config, WEIGHTS)


def load_kinematics(toolhead, config):
    if config.has_section("dual_carriage"):
        return DualLinearMachine(toolhead, config, WEIGHTS, DUAL_WEIGHTS)
    return HybridCoreXZKinematics(toolhead, config)
