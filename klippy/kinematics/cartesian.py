# SPDX-License-Identifier: GPL-3.0-or-later
"""Cartesian machines: each axis has motors of its own."""

from klippy.kinematics.dual_linear import DualLinearMachine
from klippy.kinematics.linear import LinearMachine

WEIGHTS = ((1., 0., 0.), (0., 1., 0.), (0., 0., 1.))


# Of the motors of a second carriage, by its axis
DUAL_WEIGHTS = {0: WEIGHTS[0], 1: WEIGHTS[1]}


class CartKinematics(LinearMachine):
    """One rail an axis."""

    def __init__(self, toolhead, config):
        super().__init__(toolhead, config, WEIGHTS)


def load_kinematics(toolhead, config):
    if config.has_section("dual_carriage"):
        return DualLinearMachine(toolhead, config, WEIGHTS, DUAL_WEIGHTS)
    return CartKinematics(toolhead, config)
