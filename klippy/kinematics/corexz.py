# SPDX-License-Identifier: GPL-3.0-or-later
"""CoreXZ machines: two motors turn together for x, against each other for z."""

from klippy.kinematics.linear import LinearMachine

WEIGHTS = ((1., 0., 1.), (0., 1., 0.), (1., 0., -1.))


class CoreXZKinematics(LinearMachine):
    """Rails stepper_x and stepper_z share the axes x and z."""

    def __init__(self, toolhead, config):
        super().__init__(toolhead, config, WEIGHTS)


def load_kinematics(toolhead, config):
    return CoreXZKinematics(toolhead, config)
