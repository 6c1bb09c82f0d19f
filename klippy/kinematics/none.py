# SPDX-License-Identifier: GPL-3.0-or-later
"""Machines without axes x, y and z: only extra axes, or none at all."""

from klippy.gcode_command import Coord


class NoneKinematics:
    """Nothing moves, and every position is right."""

    def __init__(self, toolhead, config):
        self.origin = Coord(0., 0., 0., 0.)

    def get_steppers(self):
        """No steppers."""
        return []

    def calc_position(self, stepper_positions):
        """[0, 0, 0]."""
        return [0., 0., 0.]

    def set_position(self, newpos, homing_axes=""):
        """Nothing to do."""

    def clear_homing_state(self, clear_axes):
        """Nothing to do."""

    def home(self, homing_state):
        """Nothing to do."""

    def check_move(self, move):
        """Any move will do."""
        return 0

    def get_status(self, eventtime):
        """No axis is homed; the ranges are empty."""
        return {"homed_axes": "", "axis_minimum": self.origin,
                "axis_maximum": self.origin}


def load_kinematics(toolhead, config):
    return NoneKinematics(toolhead, config)
