# SPDX-License-Identifier: GPL-3.0-or-later
"""Deltesians: two carriages on columns hold the head in x and z; y is a rail.

Heights of carriages count as on deltas, see klippy.kinematics.delta.
"""

import math

import cython

from klippy import stepper
from klippy.errors import CommandError
from klippy.kinematics.box import BoxMachine
from klippy.kinematics.delta import HOMING_MARGIN, TOP_SLACK, Tower
from klippy.kinematics.limits import list_axes, make_error
from klippy.kinematics.linear import home_axis
from klippy_ext.kin_deltesian import DeltesianKinematics
from klippy_ext.kin_linear import LinearKinematics

if cython.compiled:
    from cython.cimports.libc.math import fabs, fmax, sqrt
else:
    from math import fabs, sqrt
    fmax = max

SIDES = (("left", -1.), ("right", 1.))
SLOW_RATIO = 3.
MIN_ANGLE = 5.


def read_columns(config, rails):
    """The Towers of the rails of left and right.  Raises ConfigError."""
    columns, reach, arm = [], None, None
    for rail, (name, side) in zip(rails, SIDES, strict=True):
        section = config.getsection("stepper_" + name)
        if arm is None:
            reach = section.getfloat("arm_x_length", above=0.)
            arm = section.getfloat("arm_length", above=reach)
        else:
            reach = section.getfloat("arm_x_length", reach, above=0.)
            arm = section.getfloat("arm_length", arm, above=reach)
        top = (rail.get_homing_info().position_endstop
               + math.sqrt(arm ** 2 - reach ** 2))
        columns.append(Tower(side * reach, 0., arm ** 2, top, 0.))
    return columns


def find_highest(column, box):
    """Height that the carriage of a Tower cannot pass in a box [(least, greatest)].

    It comes there if the box is level.
    """
    low, high = box[0]
    near = max(low - column.x, column.x - high, 0.)
    return box[2][1] + math.sqrt(max(column.arm2 - near * near, 0.))


class DeltesianMachine(BoxMachine):
    """Rails stepper_left and stepper_right home together, stepper_y alone."""

    def __init__(self, toolhead, config):
        super().__init__(config, self._make_rails(config))
        self.columns = read_columns(config, self.rails[:2])
        self._connect_rails(toolhead.get_trapq())
        self.home_x, self.home_z = self.calc_point(
            [column.top for column in self.columns])
        self.max_velocity, self.max_accel = toolhead.get_max_velocity()
        self.open_box(toolhead, config, [
            self._read_width(config), self.rails[2].get_range(),
            self._read_height(config)])
        self.slow_ratio = config.getfloat("slow_ratio", SLOW_RATIO, minval=0.)
        self.set_position([0., 0., 0.])

    def _make_rails(self, config):
        rails, top = [], None
        for name, _ in SIDES:
            rails.append(stepper.LookupRail(
                config.getsection("stepper_" + name), need_position_minmax=False,
                default_position_endstop=top))
            top = rails[0].get_homing_info().position_endstop
        return [*rails, stepper.LookupMultiRail(config.getsection("stepper_y"))]

    def _connect_rails(self, trapq):
        for rail, column in zip(self.rails[:2], self.columns, strict=True):
            for motor in rail.get_steppers():
                motor.set_stepper_kinematics(
                    DeltesianKinematics(column.arm2, column.x))
        for motor in self.rails[2].get_steppers():
            motor.set_stepper_kinematics(LinearKinematics(0., 1., 0.))
        for motor in self.get_steppers():
            motor.set_trapq(trapq)

    def _read_width(self, config):
        """(least, greatest) x at which no arm lies flatter than min_angle."""
        angle = config.getfloat("min_angle", MIN_ANGLE, minval=0., maxval=90.)
        left, right = self.columns
        low = right.x - math.sqrt(right.arm2) * math.cos(math.radians(angle))
        high = left.x + math.sqrt(left.arm2) * math.cos(math.radians(angle))
        if not low < 0. < high:
            raise config.error(
                "Option 'min_angle' in section 'printer': with arms at %g degrees or"
                " more x can only be %.3f to %.3f, which is no room around 0"
                % (angle, low, high))
        width = config.getfloat("print_width", None, above=0.,
                                maxval=2. * min(-low, high))
        if width is not None:
            return -0.5 * width, 0.5 * width
        return low, high

    def _read_height(self, config):
        """(least, greatest) z."""
        top = min(rail.get_homing_info().position_endstop for rail in self.rails[:2])
        if top <= 0.:
            low = config.getfloat("minimum_z_position", maxval=top)
        else:
            low = config.getfloat("minimum_z_position", 0., maxval=top)
        if abs(self.home_z - top) < TOP_SLACK:
            self.home_z = top
        return low, max(top, self.home_z)

    # Positions

    def calc_point(self, heights):
        """[x, z] of the head for the heights of the carriages.

        Raises CommandError if the arms do not meet.
        """
        left, right = self.columns
        dx, dz = right.x - left.x, heights[1] - heights[0]
        apart2 = dx * dx + dz * dz
        # share of the way between the carriages, and how far below it
        share = 0.5 + 0.5 * (left.arm2 - right.arm2) / apart2
        below2 = left.arm2 / apart2 - share * share
        if below2 < 0.:
            raise CommandError("No head is held by carriages at %.3f, %.3f: the arms"
                               " are too short" % tuple(heights))
        below = math.sqrt(below2)
        return [left.x + share * dx + below * dz, heights[0] + share * dz - below * dx]

    def calc_position(self, stepper_positions):
        """[x, y, z] of the head for {stepper name: position}, mm."""
        *heights, y = (stepper_positions[rail.get_name()] for rail in self.rails)
        x, z = self.calc_point(heights)
        return [x, y, z]

    def clear_homing_state(self, clear_axes):
        """The axes ("xyz") must be homed again; x and z together."""
        axes = list_axes(clear_axes)
        if 0 in axes or 2 in axes:
            axes = [0, 2, *axes]
        super().clear_homing_state(axes)

    # Moves

    def check_move(self, move):
        """Let a move pass, slowed down where a carriage cannot follow.

        Raises CommandError if the head or a carriage would leave its room.
        """
        self.limits.check_move(move)
        if move.d_x == 0. and move.d_z == 0.:
            return 0
        self._check_carriages(move)
        if move.d_x != 0.:
            self.slow_down(move, fmax(self.find_ratio(move.start_x),
                                      self.find_ratio(move.end_x)))
        return 0

    def slow_down(self, move, ratio):
        """Slow a move in x on which a carriage is so much faster than the head."""
        if self.slow_ratio <= 0.:
            return 0
        if ratio > 2. * self.slow_ratio:
            move.limit_speed(0.25 * self.max_velocity, 0.25 * self.max_accel)
        elif ratio > self.slow_ratio:
            move.limit_speed(0.5 * self.max_velocity, 0.5 * self.max_accel)
        return 0

    def accepts_arc(self, arc):
        """True if check_arc() knows all of it: level, or away from the endstops."""
        if arc.normal == 2 and arc.start[2] == arc.end[2]:
            return True
        box = arc.find_box()
        return all(find_highest(column, box) <= column.top
                   for column in self.columns)

    def check_arc(self, move):
        """As check_move(), for a move along an arc: all of it counts."""
        self.limits.check_arc(move)
        box = move.arc.find_box()
        low, high = box[0]
        for rail, column in zip(self.rails[:2], self.columns, strict=True):
            start = column.calc_carriage(move.start_x, 0., move.start_z)
            over = find_highest(column, box) - max(column.top, start)
            if over > TOP_SLACK:
                raise self._make_top_error(move, rail, over)
        if low < high:
            self.slow_down(move, fmax(self.find_ratio(low), self.find_ratio(high)))
        return 0

    def find_ratio(self, x):
        """Way of the faster carriage for a way of the head in x."""
        ratio = 0.
        for column in self.columns:
            off = fabs(x - column.x)
            ratio = fmax(ratio, off / sqrt(fmax(column.arm2 - off * off, 1e-12)))
        return ratio

    def _check_carriages(self, move):
        for rail, column in zip(self.rails[:2], self.columns, strict=True):
            over = column.find_over(move)
            if over > TOP_SLACK:
                raise self._make_top_error(move, rail, over)

    def _make_top_error(self, move, rail, over):
        return make_error(
            move, "Move out of range", "the carriage of %s would go %.3f mm"
            " past its endstop" % (rail.get_name(), over))

    # Homing

    def home(self, homing_state):
        """Home x and z by both carriages, y by itself.  Raises CommandError."""
        wanted = homing_state.get_axes()
        axes = [1] if 1 in wanted else []
        if 0 in wanted or 2 in wanted:
            axes = [0, 2, *axes]
        homing_state.set_axes(axes)
        if 0 in axes:
            low, high = self.limits.get_range(2)
            start = self.home_z - HOMING_MARGIN * (high - low)
            homing_state.home_rails(self.rails[:2], [self.home_x, None, start, None],
                                    [self.home_x, None, self.home_z, None])
        if 1 in axes:
            home_axis(homing_state, 1, self.rails[2])


def load_kinematics(toolhead, config):
    return DeltesianMachine(toolhead, config)
