# SPDX-License-Identifier: GPL-3.0-or-later
"""Polar machines: the bed turns, an arm moves the head to and from its centre.

See docs/internals/kinematics.md, also for what happens near the centre.
"""

import math

import cython

from klippy import stepper
from klippy.kinematics.box import BoxMachine
from klippy.kinematics.limits import list_axes, make_error
from klippy.kinematics.linear import HOMING_MARGIN, home_axis
from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.kin_polar import CORE, PolarBedKinematics
from klippy_ext.kin_winch import RadiusKinematics

if cython.compiled:
    from cython.cimports.libc.math import fmax, fmin, sqrt
else:
    from math import sqrt
    fmin, fmax = min, max

# Without max_angular_velocity the bed makes at most so many steps a second
BED_STEP_RATE = 50000.
# Distances within this share of each other are the same
SLACK = 1e-6


class Span:
    """How near the centre a move comes, and how far from it."""

    def __init__(self, move):
        way2 = move.d_x * move.d_x + move.d_y * move.d_y
        foot = -(move.start_x * move.d_x + move.start_y * move.d_y) / way2
        # share of the way at which the centre is nearest
        self.foot = foot
        foot = fmin(fmax(foot, 0.), 1.)
        x, y = move.start_x + foot * move.d_x, move.start_y + foot * move.d_y
        self.way = sqrt(way2)
        self.nearest = sqrt(x * x + y * y)
        start2 = move.start_x * move.start_x + move.start_y * move.start_y
        end2 = move.end_x * move.end_x + move.end_y * move.end_y
        self.farthest = sqrt(fmax(start2, end2))

    def find_crossings(self, move, radius):
        """Shares of the way at which the move is at a radius."""
        x = move.start_x + self.foot * move.d_x
        y = move.start_y + self.foot * move.d_y
        half2 = radius * radius - x * x - y * y
        if half2 <= 0.:
            return []
        half = sqrt(half2) / self.way
        return [share for share in (self.foot - half, self.foot + half)
                if 0. < share < 1.]


class PolarKinematics(BoxMachine):
    """stepper_bed turns; the rails stepper_arm and stepper_z move and home."""

    def __init__(self, toolhead, config):
        self.toolhead = toolhead
        self.bed = stepper.PrinterStepper(config.getsection("stepper_bed"), True)
        self.arm = stepper.LookupRail(config.getsection("stepper_arm"))
        self.rail_z = stepper.LookupMultiRail(config.getsection("stepper_z"))
        super().__init__(config, [self.arm, self.rail_z])
        for motor in self.get_steppers():
            motor.set_trapq(toolhead.get_trapq())
        for motor in self.rail_z.get_steppers():
            motor.set_stepper_kinematics(LinearKinematics(0., 0., 1.))
        # kept over homing: what is set up in them (a shaper, say) holds
        self.motor_kinematics = PolarBedKinematics(), RadiusKinematics()
        self._connect(*self.motor_kinematics)
        self._find_room(toolhead, config)
        self.is_homing = False

    def _find_room(self, toolhead, config):
        self.min_radius, self.max_radius = self.arm.get_range()
        if self.max_radius <= 0.:
            raise config.error(
                "Option 'position_max' in section 'stepper_arm': '%g' must be above 0:"
                " it is the greatest distance from the centre" % (self.max_radius,))
        reach = -self.max_radius, self.max_radius
        self.open_box(toolhead, config, [reach, reach, self.rail_z.get_range()])
        self.max_angular_velocity = config.getfloat(
            "max_angular_velocity", BED_STEP_RATE * self.bed.get_step_dist(), above=0.)

    def _connect(self, bed, arm):
        """Let bed and arm move by these StepperKinematics."""
        self.bed.set_stepper_kinematics(bed)
        self.arm.get_steppers()[0].set_stepper_kinematics(arm)

    # Positions

    def get_steppers(self):
        """All MCU_steppers, that of the bed first."""
        return [self.bed, *self.arm.get_steppers(), *self.rail_z.get_steppers()]

    def calc_position(self, stepper_positions):
        """[x, y, z] of the head for {stepper name: position}, radians and mm."""
        angle = stepper_positions[self.bed.get_name()]
        radius = stepper_positions[self.arm.get_name()]
        return [radius * math.cos(angle), radius * math.sin(angle),
                stepper_positions[self.rail_z.get_name()]]

    def set_position(self, newpos, homing_axes=""):
        """The head is at newpos; x and y become homed together."""
        for motor in self.get_steppers():
            motor.set_position(newpos)
        axes = list_axes(homing_axes)
        self.set_homed(axes if 0 in axes and 1 in axes
                       else [axis for axis in axes if axis == 2])

    def clear_homing_state(self, clear_axes):
        """The axes ("xyz") must be homed again; x and y together."""
        axes = list_axes(clear_axes)
        if 0 in axes or 1 in axes:
            axes = [0, 1, *axes]
        super().clear_homing_state(axes)

    # Moves

    def check_move(self, move):
        """Let a move pass, slowed down where the bed cannot follow.

        Returns 1 if it should be made in parts, see list_cuts(); they differ in
        how fast they may be.  Raises CommandError if it leaves the reach.
        """
        self.limits.check_move(move)
        if (move.d_x == 0. and move.d_y == 0.) or self.is_homing:
            return 0
        span = Span(move)
        if span.farthest > self.max_radius or span.nearest < self.min_radius:
            self._check_reach(move, span)
        free = sqrt(move.max_cruise_v2) / self.max_angular_velocity
        if span.nearest * (1. + SLACK) >= free:
            return 0
        if span.farthest > fmax(2. * span.nearest, CORE) * (1. + SLACK):
            return 1
        radius = span.nearest
        if radius * (1. + SLACK) < CORE:
            # the bed may have to turn half round within the core
            radius = CORE / math.pi
        move.limit_speed(self.max_angular_velocity * radius, move.accel)
        return 0

    def list_cuts(self, move):
        """Shares of a move's way at which to part it, so that no part comes
        twice as close to the centre as another of its places."""
        span, cuts, radius = Span(move), [], CORE
        free = math.sqrt(move.max_cruise_v2) / self.max_angular_velocity
        while radius < free:
            cuts += span.find_crossings(move, radius)
            radius *= 2.
        return sorted(cuts + span.find_crossings(move, free))

    def accepts_arc(self, arc):
        """True if it need not be made in parts, however fast it is to be."""
        if arc.normal != 2:
            return False
        near, far = arc.find_nearest(0., 0.)
        velocity, _ = self.toolhead.get_max_velocity()
        return (near * self.max_angular_velocity >= velocity
                or (near > CORE and far <= 2. * near))

    def check_arc(self, move):
        """As check_move(), for a move along an arc around a vertical axis."""
        self.limits.check_arc(move)
        near, far = move.arc.find_nearest(0., 0.)
        if far > self.max_radius + SLACK or near < self.min_radius - SLACK:
            self._refuse_reach(move, near, far)
        if near * self.max_angular_velocity < math.sqrt(move.max_cruise_v2):
            move.limit_speed(near * self.max_angular_velocity, move.accel)
        return 0

    def _check_reach(self, move, span):
        radius = math.hypot(move.end_x, move.end_y)
        if radius > self.max_radius or span.nearest < self.min_radius:
            self._refuse_reach(move, span.nearest, radius)

    def _refuse_reach(self, move, near, far):
        if far > self.max_radius:
            raise make_error(move, "Move out of range", "%.3f from the center is more"
                             " than %.3f" % (far, self.max_radius))
        raise make_error(
            move, "Move out of range", "it leads to %.3f from the center, nearer"
            " than %.3f" % (near, self.min_radius))

    # Homing

    def home(self, homing_state):
        """Home x and y by the arm, z by itself.  Raises CommandError."""
        wanted = homing_state.get_axes()
        axes = [2] if 2 in wanted else []
        if 0 in wanted or 1 in wanted:
            axes = [0, 1, *axes]
        homing_state.set_axes(axes)
        if 0 in axes:
            self._home_arm(homing_state)
        if 2 in axes:
            home_axis(homing_state, 2, self.rail_z)

    def _home_arm(self, homing_state):
        """Home the arm along x, as a linear axis that may pass the centre.

        Where the bed is then becomes its angle 0.
        """
        info = self.arm.get_homing_info()
        far_end = self.arm.get_range()[0 if info.positive_dir else 1]
        start = (info.position_endstop
                 - HOMING_MARGIN * (info.position_endstop - far_end))
        self.toolhead.flush_step_generation()
        self._connect(LinearKinematics(0., 0., 0.), LinearKinematics(1., 0., 0.))
        self.is_homing = True
        try:
            homing_state.home_rails([self.arm], [start, 0., None, None],
                                    [info.position_endstop, 0., None, None])
        finally:
            self.is_homing = False
            self.toolhead.flush_step_generation()
            self._connect(*self.motor_kinematics)
            self.toolhead.set_position(self.toolhead.get_position())


def load_kinematics(toolhead, config):
    return PolarKinematics(toolhead, config)
