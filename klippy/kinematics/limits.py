# SPDX-License-Identifier: GPL-3.0-or-later
"""The box in which a head may move, and how fast it may go up and down.

Units: mm, mm/s, mm/s^2.
"""

import cython

from klippy.gcode_command import Coord

AXES = "xyz"
# An axis that is not homed has this range: nothing is in it
UNHOMED = (1.0, -1.0)


class MoveLimits:
    """Ranges of the axes, of which those not homed are empty."""

    def __init__(self, ranges, max_z_velocity, max_z_accel):
        self.max_z_velocity, self.max_z_accel = max_z_velocity, max_z_accel
        if not cython.compiled:
            self.low, self.high = [0.] * 3, [0.] * 3
            self.soft_low, self.soft_high = [0.] * 3, [0.] * 3
        for i in range(3):
            self.soft_low[i], self.soft_high[i] = ranges[i]
            self.low[i], self.high[i] = UNHOMED

    def set_homed(self, axis):
        """The axis (0, 1, 2) may be used."""
        self.low[axis], self.high[axis] = self.soft_low[axis], self.soft_high[axis]

    def set_range(self, axis, low, high):
        """Change the range of an axis; it stays homed or not."""
        is_homed = self.is_homed(axis)
        self.soft_low[axis], self.soft_high[axis] = low, high
        if is_homed:
            self.set_homed(axis)

    def clear_homed(self, axis):
        """The axis may not be used any more."""
        self.low[axis], self.high[axis] = UNHOMED

    def is_homed(self, axis):
        """True if the axis may be used."""
        return self.low[axis] <= self.high[axis]

    def get_range(self, axis):
        """(least, greatest) position of an axis, homed or not."""
        return self.soft_low[axis], self.soft_high[axis]

    def is_inside(self, move):
        """True if the move ends in the ranges of homed axes."""
        return (self.low[0] <= move.end_x <= self.high[0]
                and self.low[1] <= move.end_y <= self.high[1]
                and self.low[2] <= move.end_z <= self.high[2])

    def check_move(self, move):
        """Raises CommandError for a move out of range; slows one in z."""
        if not self.is_inside(move):
            self._explain(move)
        if move.d_z == 0.:
            return 0
        ratio = move.move_d / abs(move.d_z)
        move.limit_speed(self.max_z_velocity * ratio, self.max_z_accel * ratio)
        return 0

    def _explain(self, move):
        """Raise the error of a move that is not inside, if an axis moves so."""
        ends = move.end_pos
        for i, way in enumerate(move.axes_d[:3]):
            if not way or self.low[i] <= ends[i] <= self.high[i]:
                continue
            if not self.is_homed(i):
                raise move.move_error("Must home axis first")
            raise move.move_error(
                "Move out of range: %s=%.3f is not in %.3f to %.3f; position"
                % (AXES[i], ends[i], self.low[i], self.high[i]))

    def get_status(self):
        """homed_axes, axis_minimum and axis_maximum."""
        homed = "".join(AXES[i] for i in range(3) if self.is_homed(i))
        return {"homed_axes": homed,
                "axis_minimum": Coord([self.soft_low[i] for i in range(3)] + [0.]),
                "axis_maximum": Coord([self.soft_high[i] for i in range(3)] + [0.])}
