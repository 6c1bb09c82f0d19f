# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear deltas: three carriages on towers hold the head by arms of fixed length.

Heights of carriages count from where the head is at z = 0, straight below; so
a carriage is at z + sqrt(arm^2 - distance^2).  See docs/internals/kinematics.md.
"""

import math

import cython

from klippy import stepper
from klippy.kinematics.arms import ArmsMachine, find_meeting
from klippy.kinematics.delta_calibration import DeltaCalibration
from klippy.kinematics.limits import make_error
from klippy_ext import kin_delta

if cython.compiled:
    from cython.cimports.libc.math import fabs, fmax, fmin, sqrt
else:
    from math import fabs, sqrt
    fmin, fmax = min, max

ANGLES = (("a", 210.), ("b", 330.), ("c", 90.))
# Way of a carriage for a way of the head: beyond the first the head is slowed
# down so that no carriage is faster, beyond the second it does not go
SLOW_RATIO, MAX_RATIO = 3., 12.
HOMING_MARGIN = 1.5
# mm by which rounding may take a carriage past its endstop
TOP_SLACK = 1e-6


class Tower:
    """One tower at x, y with an arm; its carriage goes up to `top`.

    y_share: 1, or 0 for an arm to which y does not matter.
    """

    def __init__(self, x, y, arm2, top, y_share=1.):
        self.x, self.y, self.arm2, self.top = x, y, arm2, top
        self.y_share = y_share

    def calc_carriage(self, x, y, z):
        """Height of the carriage for a head there."""
        dx, dy = x - self.x, (y - self.y) * self.y_share
        return z + sqrt(fmax(self.arm2 - dx * dx - dy * dy, 0.))

    def find_highest(self, move):
        """Greatest height of the carriage during a move.

        It is slope * t + sqrt(reach2 - t * t) and a constant, with t from
        the foot of the tower along the way: a hill with a single top.
        """
        way_y = move.d_y * self.y_share
        way = sqrt(move.d_x * move.d_x + way_y * way_y)
        highest = fmax(
            self.calc_carriage(move.start_x, move.start_y, move.start_z),
            self.calc_carriage(move.end_x, move.end_y, move.end_z))
        if way == 0.:
            return highest
        dx, dy = move.start_x - self.x, (move.start_y - self.y) * self.y_share
        along = (dx * move.d_x + dy * way_y) / way
        across2 = fmax(dx * dx + dy * dy - along * along, 0.)
        reach2 = fmax(self.arm2 - across2, 0.)
        slope = move.d_z / way
        turn = slope * sqrt(reach2 / (1. + slope * slope))
        if along < turn < along + way:
            return (move.start_z + slope * (turn - along)
                    + sqrt(fmax(reach2 - turn * turn, 0.)))
        return highest

    def find_over(self, move):
        """mm by which a move leads further past the endstop than it starts."""
        start = self.calc_carriage(move.start_x, move.start_y, move.start_z)
        return self.find_highest(move) - fmax(self.top, start)


def read_towers(config, rails, radius):
    """The Towers of the rails.  Raises ConfigError."""
    towers, arm = [], None
    for rail, (name, angle) in zip(rails, ANGLES, strict=True):
        section = config.getsection("stepper_" + name)
        if arm is None:
            arm = first = section.getfloat("arm_length", above=radius)
        else:
            arm = section.getfloat("arm_length", first, above=radius)
        angle = math.radians(section.getfloat("angle", angle))
        top = rail.get_homing_info().position_endstop + math.sqrt(arm ** 2
                                                                  - radius ** 2)
        towers.append(Tower(radius * math.cos(angle), radius * math.sin(angle),
                            arm ** 2, top))
    return towers


class DeltaKinematics(ArmsMachine):
    """Rails stepper_a, stepper_b, stepper_c, which home together."""

    def __init__(self, toolhead, config):
        super().__init__(toolhead, config)
        self.max_z_accel = config.getfloat(
            "max_z_accel", self.max_accel, above=0., maxval=self.max_accel)
        self.radius = config.getfloat("delta_radius", above=0.)
        self.rails = self._make_rails(config)
        self.towers = read_towers(config, self.rails, self.radius)
        self._connect_rails(toolhead.get_trapq())
        self._find_room(config)
        self.set_position([0., 0., 0.])

    def _make_rails(self, config):
        rails, top = [], None
        for name, _ in ANGLES:
            rails.append(stepper.LookupMultiRail(
                config.getsection("stepper_" + name), need_position_minmax=False,
                default_position_endstop=top))
            top = rails[0].get_homing_info().position_endstop
        return rails

    def _connect_rails(self, trapq):
        for rail, tower in zip(self.rails, self.towers, strict=True):
            for motor in rail.get_steppers():
                motor.set_stepper_kinematics(kin_delta.DeltaKinematics(
                    tower.arm2, tower.x, tower.y))
                motor.set_trapq(trapq)

    def _find_room(self, config):
        """Work out where the head may be."""
        self.max_z = min(rail.get_homing_info().position_endstop
                         for rail in self.rails)
        self.min_z = config.getfloat("minimum_z_position", 0., maxval=self.max_z)
        if self.min_z > self.max_z:
            raise config.error(
                "Option 'minimum_z_position' in section 'printer': its default %.3f"
                " is above the lowest position_endstop, %.3f"
                % (self.min_z, self.max_z))
        self.min_arm2 = min(tower.arm2 for tower in self.towers)
        self.cone_start_z = min(tower.top - math.sqrt(tower.arm2)
                                for tower in self.towers)
        wanted = config.getfloat("print_radius", self.radius, above=0.)
        self.set_reach(min(wanted, self._find_reach(MAX_RATIO)))
        self.slow_radius2 = max(self._find_reach(SLOW_RATIO), 0.) ** 2
        if self.max_radius <= 0.:
            raise config.error(
                "Option 'arm_length' in section 'stepper_a': arms of %.3f are too"
                " short for a delta_radius of %.3f"
                % (math.sqrt(self.min_arm2), self.radius))
        self.home_position = self.calc_point([tower.top for tower in self.towers])

    def _find_reach(self, ratio):
        """Radius at which the carriage opposite is `ratio` as fast as the head."""
        return ratio * math.sqrt(self.min_arm2 / (ratio ** 2 + 1.)) - self.radius

    # Positions

    def calc_point(self, carriages):
        """[x, y, z] of the head for the heights of the three carriages.

        Raises CommandError if the arms do not meet.
        """
        return find_meeting(
            [(tower.x, tower.y, height)
             for tower, height in zip(self.towers, carriages, strict=True)],
            [tower.arm2 for tower in self.towers],
            "carriages at " + ", ".join("%.3f" % height for height in carriages))

    # Moves

    def check_move(self, move):
        """Let a move pass, slowed down where a carriage cannot follow.

        Raises CommandError if the head or a carriage would leave its room.
        """
        if not self.is_inside(move):
            self.refuse(move)
        if fmax(move.start_z, move.end_z) > self.cone_start_z:
            self._check_carriages(move)
        reach2 = move.end_x * move.end_x + move.end_y * move.end_y
        other2 = move.start_x * move.start_x + move.start_y * move.start_y
        reach2 = fmax(reach2, fmin(other2, self.max_radius2))
        if reach2 > self.slow_radius2:
            self.slow_down(move, reach2)
        if move.d_z != 0.:
            ratio = move.move_d / fabs(move.d_z)
            move.limit_speed(self.max_z_velocity * ratio, self.max_z_accel * ratio)
        return 0

    def accepts_arc(self, arc):
        """True if check_arc() knows all of it: of a helix not near the top."""
        start, end = arc.start, arc.end
        return arc.normal == 2 and (start[2] == end[2]
                                    or max(start[2], end[2]) <= self.cone_start_z)

    def check_arc(self, move):
        """As check_move(), for a move along an arc around a vertical axis."""
        reach = self.find_arc_reach(move)
        if move.end_z > self.cone_start_z:
            self._check_arc_carriages(move)
        if reach * reach > self.slow_radius2:
            self.slow_down(move, fmin(reach * reach, self.max_radius2))
        if move.d_z != 0.:
            ratio = move.move_d / fabs(move.d_z)
            move.limit_speed(self.max_z_velocity * ratio, self.max_z_accel * ratio)
        return 0

    def _check_arc_carriages(self, move):
        for rail, tower in zip(self.rails, self.towers, strict=True):
            near, _ = move.arc.find_nearest(tower.x, tower.y)
            highest = move.end_z + sqrt(tower.arm2 - near * near)
            start = tower.calc_carriage(move.start_x, move.start_y, move.start_z)
            if highest - fmax(tower.top, start) > TOP_SLACK:
                raise self._make_top_error(move, rail, highest
                                           - fmax(tower.top, start))

    def _make_top_error(self, move, rail, over):
        return make_error(move, "Move out of range", "the carriage of %s would go %.3f"
                          " mm past its endstop" % (rail.get_name(), over))

    def slow_down(self, move, reach2):
        """Keep carriages at SLOW_RATIO of the printer's limits at a radius."""
        distance = self.radius + sqrt(reach2)
        ratio = distance / sqrt(self.min_arm2 - distance * distance)
        move.limit_speed(self.max_velocity * SLOW_RATIO / ratio,
                         self.max_accel * SLOW_RATIO / ratio)
        return 0

    def _check_carriages(self, move):
        for rail, tower in zip(self.rails, self.towers, strict=True):
            over = tower.find_over(move)
            if over > TOP_SLACK:
                raise self._make_top_error(move, rail, over)

    # Homing

    def home(self, homing_state):
        """Home all three towers together.  Raises CommandError."""
        homing_state.set_axes([0, 1, 2])
        lowest = math.sqrt(self.min_arm2 - (self.radius + self.max_radius) ** 2)
        way = max(tower.top for tower in self.towers) - self.min_z - lowest
        start = list(self.home_position)
        start[2] -= HOMING_MARGIN * way
        homing_state.home_rails(self.rails, [*start, None],
                                [*self.home_position, None])

    def get_calibration(self):
        """The DeltaCalibration by which the machine moves."""
        return DeltaCalibration(
            self.radius,
            tuple(math.degrees(math.atan2(t.y, t.x)) % 360. for t in self.towers),
            tuple(math.sqrt(tower.arm2) for tower in self.towers),
            tuple(r.get_homing_info().position_endstop for r in self.rails),
            tuple(rail.get_steppers()[0].get_step_dist() for rail in self.rails))

    def get_status(self, eventtime):
        """Status of printer.toolhead: homed_axes, ranges, cone_start_z."""
        return {**super().get_status(eventtime), "cone_start_z": self.cone_start_z}


def load_kinematics(toolhead, config):
    return DeltaKinematics(toolhead, config)
