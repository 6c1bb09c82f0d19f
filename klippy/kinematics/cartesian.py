# SPDX-License-Identifier: GPL-3.0-or-later
"""Cartesian machines: each axis has motors of its own."""

from klippy.kinematics.linear import LinearMachine

WEIGHTS = ((1., 0., 0.), (0., 1., 0.), (0., 0., 1.))


class CartKinematics(LinearMachine):
    """One rail an axis."""

    def __init__(self, toolhead, config):
        if config.has_section("dual_carriage"):
            raise config.error("Section [dual_carriage] is not supported yet: this"
                               " version moves one carriage an axis")
        super().__init__(toolhead, config, WEIGHTS)


def load_kinematics(toolhead, config):
    return CartKinematics(toolhead, config)
