# SPDX-License-Identifier: GPL-3.0-or-later
"""Hybrid corexy (Markforged) machines: the belt of x runs along with y."""

from klippy.kinematics.linear import LinearMachine

WEIGHTS = ((1., -1., 0.), (0., 1., 0.), (0., 0., 1.))


class HybridCoreXYKinematics(LinearMachine):
    """stepper_y moves y alone; stepper_x moves x and makes up for y."""

    def __init__(self, toolhead, config):
        super().__init__(toolhead, config, WEIGHTS)


def load_kinematics(toolhead, config):
    return HybridCoreXYKinematics(toolhead, config)
