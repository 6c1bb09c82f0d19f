# SPDX-License-Identifier: GPL-3.0-or-later
"""Hybrid corexz machines: the belt of x runs along with z."""

from klippy.kinematics.dual_linear import DualLinearMachine
from klippy.kinematics.linear import LinearMachine

WEIGHTS = ((1., 0., -1.), (0., 1., 0.), (0., 0., 1.))
# Of the motor of a second carriage on x, whose belt runs the other way
DUAL_WEIGHTS = {0: (1., 0., 1.)}


class HybridCoreXZKinematics(LinearMachine):
    """stepper_z moves z alone; stepper_x moves x and makes up for z."""

    def __init__(self, toolhead, config, weights=WEIGHTS):
        super().__init__(toolhead, config, weights)


def load_kinematics(toolhead, config):
    weights, dual_weights = WEIGHTS, DUAL_WEIGHTS
    if config.getboolean("invert_kinematics", False):
        # the belt of x runs on the other side, so the carriages change places
        weights = (DUAL_WEIGHTS[0], *WEIGHTS[1:])
        dual_weights = {0: WEIGHTS[0]}
    if config.has_section("dual_carriage"):
        return DualLinearMachine(toolhead, config, weights, dual_weights)
    return HybridCoreXZKinematics(toolhead, config, weights)
