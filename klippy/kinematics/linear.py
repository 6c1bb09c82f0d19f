# SPDX-License-Identifier: GPL-3.0-or-later
"""Machines whose motors move by weighted sums of x, y and z.

A kind is a table of the weights, one row a rail; all else follows from it.
"""

from klippy import stepper
from klippy.kinematics.box import BoxMachine
from klippy.kinematics.limits import AXES
from klippy.mathutil import matrix_cross, matrix_dot
from klippy_ext.kin_linear import LinearKinematics

# A homing move is so much longer than the range
HOMING_MARGIN = 1.5


def invert(rows):
    """Inverse of a 3 x 3 matrix given as rows.  It must not be singular."""
    columns = [matrix_cross(rows[1], rows[2]), matrix_cross(rows[2], rows[0]),
               matrix_cross(rows[0], rows[1])]
    scale = matrix_dot(rows[0], columns[0])
    return [[column[i] / scale for column in columns] for i in range(3)]


def home_axis(homing_state, axis, rail):
    """Move an axis towards its endstop from beyond its other end."""
    info = rail.get_homing_info()
    far_end = rail.get_range()[0 if info.positive_dir else 1]
    way = HOMING_MARGIN * (info.position_endstop - far_end)
    target, start = [None] * 4, [None] * 4
    target[axis] = info.position_endstop
    start[axis] = info.position_endstop - way
    homing_state.home_rails([rail], start, target)


class LinearMachine(BoxMachine):
    """Rails stepper_x, stepper_y, stepper_z; each homes the axis of its name.

    weights: three rows, what x, y and z add to the position of each rail.
    """

    def __init__(self, toolhead, config, weights):
        super().__init__(config, [
            stepper.LookupMultiRail(config.getsection("stepper_" + axis))
            for axis in AXES])
        self.inverse = invert(weights)
        self._connect_rails(weights, toolhead.get_trapq())
        self._share_endstops(weights)
        self.open_box(toolhead, config, [rail.get_range() for rail in self.rails])

    def _connect_rails(self, weights, trapq):
        for rail, row in zip(self.rails, weights, strict=True):
            for motor in rail.get_steppers():
                motor.set_stepper_kinematics(LinearKinematics(*row))
                motor.set_trapq(trapq)

    def _share_endstops(self, weights):
        """Let an axis' endstops stop the other rails that the axis moves too."""
        for axis, rail in enumerate(self.rails):
            others = [motor for other, row in zip(self.rails, weights, strict=True)
                      if other is not rail and row[axis]
                      for motor in other.get_steppers()]
            for endstop, _ in rail.get_endstops():
                for motor in others:
                    endstop.add_stepper(motor)

    # Positions

    def calc_position(self, stepper_positions):
        """[x, y, z] of the head for {stepper name: position}, mm."""
        positions = [stepper_positions[rail.get_name()] for rail in self.rails]
        return [matrix_dot(row, positions) for row in self.inverse]

    # Homing

    def home(self, homing_state):
        """Home the axes of a Homing, one after the other.

        Raises CommandError.
        """
        for axis in homing_state.get_axes():
            self.home_axis(homing_state, axis, self.rails[axis])

    def home_axis(self, homing_state, axis, rail):
        """Home one axis; for plug-ins that home in an order of their own."""
        home_axis(homing_state, axis, rail)
