# SPDX-License-Identifier: GPL-3.0-or-later
"""The box in which a head may move, and how fast it may go up and down.

Units: mm, mm/s, mm/s^2.  Axes are 0, 1, 2 for x, y, z.
"""

import cython

from klippy.errors import CommandError
from klippy.gcode_command import Coord

if cython.compiled:
    from cython.cimports.libc.math import fabs, sqrt
else:
    from math import fabs, sqrt

AXES = "xyz"
# mm by which rounding may take the outermost point of an arc out of a range
ARC_SLACK = 1e-6
# The range of an axis that is not homed: nothing is in it
NOWHERE = (1.0, -1.0)


def list_axes(axes):
    """Indexes of axes given as a text ("xz") or as indexes."""
    return [AXES.index(a) if isinstance(a, str) else a for a in axes]


def make_error(move, message, reason):
    """The CommandError for a move: message, where it leads, and why not."""
    return CommandError("%s (%s)" % (move.move_error(message), reason))


class MoveLimits:
    """Ranges of the axes [(least, greatest)], of which only homed ones are open."""

    def __init__(self, ranges, max_z_velocity, max_z_accel):
        self.max_z_velocity, self.max_z_accel = max_z_velocity, max_z_accel
        if not cython.compiled:
            self.low, self.high = [0.] * 3, [0.] * 3
            self.full_low, self.full_high = [0.] * 3, [0.] * 3
        for axis in range(3):
            self.full_low[axis], self.full_high[axis] = ranges[axis]
            self.clear_homed(axis)

    def set_homed(self, axis):
        """Open an axis."""
        self.low[axis], self.high[axis] = self.full_low[axis], self.full_high[axis]

    def clear_homed(self, axis):
        """Close an axis."""
        self.low[axis], self.high[axis] = NOWHERE

    def is_homed(self, axis):
        """True if the axis is open."""
        return self.low[axis] <= self.high[axis]

    def get_homed(self):
        """Names of the open axes, like "xy"."""
        return "".join(AXES[axis] for axis in range(3) if self.is_homed(axis))

    def get_range(self, axis):
        """(least, greatest) position of an axis, open or not."""
        return self.full_low[axis], self.full_high[axis]

    def set_range(self, axis, low, high):
        """Change the range of an axis; it stays open or closed."""
        is_homed = self.is_homed(axis)
        self.full_low[axis], self.full_high[axis] = low, high
        if is_homed:
            self.set_homed(axis)

    def is_inside(self, move):
        """True if the move ends where it may."""
        return (self.low[0] <= move.end_x <= self.high[0]
                and self.low[1] <= move.end_y <= self.high[1]
                and self.low[2] <= move.end_z <= self.high[2])

    def check_move(self, move):
        """Let a move pass, slowed down where z cannot follow.

        Raises CommandError if it leaves the ranges or needs an axis that is
        not homed.
        """
        if not self.is_inside(move):
            self._refuse(move)
        if move.d_z != 0.:
            ratio = move.move_d / fabs(move.d_z)
            move.limit_speed(self.max_z_velocity * ratio, self.max_z_accel * ratio)
        return 0

    def check_arc(self, move):
        """As check_move(), for a move along an arc: all of it counts."""
        arc = move.arc
        for axis, (low, high) in enumerate(arc.find_box()):
            if low < high and not (self.low[axis] <= low + ARC_SLACK
                                   and high - ARC_SLACK <= self.high[axis]):
                raise self._make_arc_error(move, axis, low, high)
        steep, pull = arc.find_steepest(2), arc.find_pull(2)
        if steep > 0.:
            move.limit_speed(self.max_z_velocity / steep, self.max_z_accel / steep)
        if pull > 0.:
            move.limit_speed(sqrt(self.max_z_accel / (arc.curvature * pull)),
                             move.accel)
        return 0

    def _make_arc_error(self, move, axis, low, high):
        if not self.is_homed(axis):
            return self.make_error(move, axis)
        far = low if low < self.low[axis] else high
        return make_error(
            move, "Move out of range", "the arc goes to %s %.3f, which is not within"
            " %.3f to %.3f" % (AXES[axis].upper(), far, *self.get_range(axis)))

    def _refuse(self, move):
        """Raise the error of a move; axes that rest may be outside."""
        ends, ways = move.end_pos, move.axes_d
        for axis in range(3):
            if ways[axis] and not self.low[axis] <= ends[axis] <= self.high[axis]:
                raise self.make_error(move, axis)

    def make_error(self, move, axis):
        """The CommandError that tells why an axis cannot follow a move."""
        if not self.is_homed(axis):
            return make_error(move, "Must home axis first", "%s is not homed"
                              % (AXES[axis].upper(),))
        return make_error(
            move, "Move out of range", "%s %.3f is not within %.3f to %.3f"
            % (AXES[axis].upper(), move.end_pos[axis], *self.get_range(axis)))

    # As plug-ins know it: a list of ranges

    def __getitem__(self, axis):
        """(least, greatest) position of an axis now; crossed if it is closed."""
        return self.low[axis], self.high[axis]

    def __setitem__(self, axis, limits):
        """Set what __getitem__() returns."""
        self.low[axis], self.high[axis] = limits

    def get_status(self):
        """homed_axes, axis_minimum and axis_maximum of printer.toolhead."""
        return {"homed_axes": self.get_homed(),
                "axis_minimum": Coord([self.get_range(i)[0] for i in range(3)] + [0.]),
                "axis_maximum": Coord([self.get_range(i)[1] for i in range(3)] + [0.])}
