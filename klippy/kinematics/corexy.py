# SPDX-License-Identifier: GPL-3.0-or-later
"""CoreXY machines: two motors turn together for x, against each other for y."""

from klippy.kinematics.linear import LinearMachine

WEIGHTS = ((1., 1., 0.), (1., -1., 0.), (0., 0., 1.))


class CoreXYKinematics(LinearMachine):
    """Rails stepper_x and stepper_y share the axes x and y."""

    def __init__(self, toolhead, config):
        super().__init__(toolhead, config, WEIGHTS)


def load_kinematics(toolhead, config):
    return CoreXYKinematics(toolhead, config)
