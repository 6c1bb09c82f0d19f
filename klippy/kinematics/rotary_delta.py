# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotary deltas: three upper arms swing about shoulders and hold the head.

Positions of the motors are the angles of the upper arms (radians): 0 level and
outwards, more is higher.  See docs/internals/kinematics.md.
"""

import math

import cython

from klippy import stepper
from klippy.kinematics.arms import ArmsMachine, find_meeting
from klippy.kinematics.limits import make_error
from klippy_ext import kin_rotary_delta

if cython.compiled:
    from cython.cimports.libc.math import acos, cos, fabs, fmax, fmin, sin, sqrt
else:
    from math import acos, cos, fabs, sin, sqrt
    fmin, fmax = min, max

ANGLES = (("a", 30.), ("b", 150.), ("c", 270.))
# As on linear deltas: way of an elbow for a way of the head
SLOW_RATIO, MAX_RATIO = 3., 12.
HOMING_MARGIN = 1.5
# Homing starts no lower than where arms are stretched to this share
STRETCH = 0.98
# Shares of an arc's way at which arms are looked at
SHARES = tuple(i / 16. for i in range(17))
# Directions in which the reach is looked at
DIRECTIONS = 48
SLACK = 1e-6


class Arm:
    """One arm: direction (radians), shoulder and lengths (mm)."""

    def __init__(self, direction, radius, height, upper, lower):
        self.direction, self.radius, self.height = direction, radius, height
        self.upper, self.lower = upper, lower
        self.cosine, self.sine = cos(direction), sin(direction)
        self.top_x = self.top_y = self.top_z = 0.

    def find_elbow(self, angle):
        """(x, y, z) of the elbow at an angle of the upper arm."""
        out = self.radius + self.upper * cos(angle)
        return (out * self.cosine, out * self.sine,
                self.height + self.upper * sin(angle))

    def set_top(self, angle):
        """The upper arm goes up to this angle."""
        self.top_x, self.top_y, self.top_z = self.find_elbow(angle)

    def find_ratio(self, x, y, z):
        """How many times as fast as the head at x, y, z the elbow can be.

        1e9 where the arm does not reach.
        """
        out = x * self.cosine + y * self.sine - self.radius
        aside = y * self.cosine - x * self.sine
        down = z - self.height
        reach = sqrt(out * out + down * down)
        # the lower arm as seen along the axis of the shoulder
        seen2 = self.lower * self.lower - aside * aside
        if seen2 <= 0. or reach <= 0.:
            return 1e9
        seen = sqrt(seen2)
        cosine = ((self.upper * self.upper + seen2 - reach * reach)
                  / (2. * self.upper * seen))
        if fabs(cosine) >= 1.:
            return 1e9
        return self.lower / (seen * sin(acos(cosine)))

    def find_over(self, move):
        """mm by which a move leads further past the arm's top than it starts."""
        x, y = move.start_x - self.top_x, move.start_y - self.top_y
        z = move.start_z - self.top_z
        start = fmin(sqrt(x * x + y * y + z * z), self.lower)
        along = -(x * move.d_x + y * move.d_y + z * move.d_z)
        share = fmin(fmax(along / (move.move_d * move.move_d), 0.), 1.)
        x, y = x + share * move.d_x, y + share * move.d_y
        z = z + share * move.d_z
        return start - sqrt(x * x + y * y + z * z)

    def find_distance(self, arc):
        """Distance from the elbow at the arm's top that an ArcPath keeps.

        The arc turns around a vertical axis; if it is level, it comes so near.
        """
        near, _ = arc.find_nearest(self.top_x, self.top_y)
        low, high = sorted((arc.start[2], arc.end[2]))
        return math.hypot(near, max(low - self.top_z, self.top_z - high, 0.))


def read_arms(config):
    """The Arms of stepper_a, stepper_b, stepper_c.  Raises ConfigError."""
    radius = config.getfloat("shoulder_radius", above=0.)
    height = config.getfloat("shoulder_height", above=0.)
    arms, upper, lower = [], None, None
    for name, angle in ANGLES:
        section = config.getsection("stepper_" + name)
        if upper is None:
            upper = section.getfloat("upper_arm_length", above=0.)
            lower = section.getfloat("lower_arm_length", above=0.)
            own = upper, lower
        else:
            own = (section.getfloat("upper_arm_length", upper, above=0.),
                   section.getfloat("lower_arm_length", lower, above=0.))
        angle = math.radians(section.getfloat("angle", angle))
        arms.append(Arm(angle, radius, height, *own))
    return arms


class RotaryDeltaMachine(ArmsMachine):
    """Rails stepper_a, stepper_b, stepper_c, which home together."""

    def __init__(self, toolhead, config):
        super().__init__(toolhead, config)
        self.arms = read_arms(config)
        self.rails = self._make_rails(config)
        self._connect_rails(toolhead.get_trapq())
        self._find_room(config)
        self.set_position([0., 0., 0.5 * (self.min_z + self.max_z)])

    def _make_rails(self, config):
        rails, top = [], None
        for name, _ in ANGLES:
            rails.append(stepper.LookupRail(
                config.getsection("stepper_" + name), need_position_minmax=False,
                default_position_endstop=top, units_in_radians=True))
            top = rails[0].get_homing_info().position_endstop
        return rails

    def _connect_rails(self, trapq):
        for rail, arm in zip(self.rails, self.arms, strict=True):
            for motor in rail.get_steppers():
                motor.set_stepper_kinematics(kin_rotary_delta.RotaryDeltaKinematics(
                    arm.radius, arm.height, arm.direction, arm.upper, arm.lower))
                motor.set_trapq(trapq)

    def _find_room(self, config):
        """Work out where the head may be."""
        tops = [rail.get_homing_info().position_endstop for rail in self.rails]
        self.max_z = min(tops)
        self.min_z = config.getfloat("minimum_z_position", 0., maxval=self.max_z)
        angles = []
        for rail, arm, top in zip(self.rails, self.arms, tops, strict=True):
            if arm.find_ratio(0., 0., top) > MAX_RATIO:
                raise config.error(
                    "Option 'position_endstop' in section '%s': the arm does not reach"
                    " the middle at a height of %.3f" % (rail.get_name(), top))
            angles.append(rail.calc_position_from_coord([0., 0., top]))
            arm.set_top(angles[-1])
        self.home_position = self.calc_point(angles)
        self.set_reach(self._find_reach())
        if self.max_radius <= 0.:
            raise config.error(
                "Option 'upper_arm_length' in section 'stepper_a': the arms do not"
                " reach the middle at a height of %.3f (minimum_z_position)"
                % (self.min_z,))

    def _find_reach(self):
        """Radius around the middle that all arms reach at the least height."""
        low, high = 0., max(arm.upper + arm.lower for arm in self.arms)
        for _ in range(40):
            radius = 0.5 * (low + high)
            if self._is_reached(radius, self.min_z):
                low = radius
            else:
                high = radius
        return low

    def _is_reached(self, radius, z):
        for i in range(DIRECTIONS):
            angle = 2. * math.pi * i / DIRECTIONS
            x, y = radius * math.cos(angle), radius * math.sin(angle)
            if self.find_ratio(x, y, z) > MAX_RATIO:
                return False
        return True

    # Positions

    def calc_point(self, angles):
        """[x, y, z] of the head for the angles of the three arms.

        Raises CommandError if the arms do not meet.
        """
        return find_meeting(
            [arm.find_elbow(angle)
             for arm, angle in zip(self.arms, angles, strict=True)],
            [arm.lower ** 2 for arm in self.arms], "arms at %s degrees" % (
                ", ".join("%.3f" % math.degrees(angle) for angle in angles),))

    # Moves

    def check_move(self, move):
        """Let a move pass, slowed down where an arm cannot follow.

        Raises CommandError if the head or an arm would leave its room.
        """
        if not self.is_inside(move):
            self.refuse(move)
        self._check_arms(move)
        self.slow_down(move, fmax(
            self.find_ratio(move.start_x, move.start_y, move.start_z),
            self.find_ratio(move.end_x, move.end_y, move.end_z)))
        return 0

    def slow_down(self, move, ratio):
        """Slow a move on which an elbow is so much faster than the head, or z."""
        if ratio > SLOW_RATIO:
            ratio = fmin(ratio, MAX_RATIO)
            move.limit_speed(self.max_velocity * SLOW_RATIO / ratio,
                             self.max_accel * SLOW_RATIO / ratio)
        if move.d_z != 0.:
            move.limit_speed(self.max_z_velocity * move.move_d / fabs(move.d_z),
                             move.accel)
        return 0

    def accepts_arc(self, arc):
        """True if check_arc() knows all of it: level, or away from the endstops."""
        return arc.normal == 2 and (arc.start[2] == arc.end[2] or all(
            arm.find_distance(arc) >= arm.lower for arm in self.arms))

    def check_arc(self, move):
        """As check_move(), for a move along an arc around a vertical axis."""
        arc = move.arc
        self.find_arc_reach(move)
        for rail, arm in zip(self.rails, self.arms, strict=True):
            start = math.dist(arc.start, (arm.top_x, arm.top_y, arm.top_z))
            if min(start, arm.lower) - arm.find_distance(arc) > SLACK:
                raise self._make_top_error(move, rail)
        self.slow_down(move, max(self.find_ratio(*arc.find_point(share))
                                 for share in SHARES))
        return 0

    def find_ratio(self, x, y, z):
        """How many times as fast as the head there an elbow can be."""
        ratio = 0.
        for arm in self.arms:
            ratio = fmax(ratio, arm.find_ratio(x, y, z))
        return ratio

    def _check_arms(self, move):
        for rail, arm in zip(self.rails, self.arms, strict=True):
            if arm.find_over(move) > SLACK:
                raise self._make_top_error(move, rail)

    def _make_top_error(self, move, rail):
        return make_error(
            move, "Move out of range", "the arm of %s would swing past its"
            " endstop" % (rail.get_name(),))

    # Homing

    def home(self, homing_state):
        """Home all three arms together.  Raises CommandError."""
        homing_state.set_axes([0, 1, 2])
        x, y, z = self.home_position
        lowest = max(arm.height - math.sqrt(
            (STRETCH * (arm.upper + arm.lower)) ** 2 - arm.radius ** 2)
            for arm in self.arms)
        start = max(z - HOMING_MARGIN * (z - self.min_z), lowest)
        homing_state.home_rails(self.rails, [x, y, start, None], [x, y, z, None])


def load_kinematics(toolhead, config):
    return RotaryDeltaMachine(toolhead, config)
