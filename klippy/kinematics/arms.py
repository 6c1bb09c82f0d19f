# SPDX-License-Identifier: GPL-3.0-or-later
"""Machines whose head hangs from three arms: a round room, homed as a whole."""

import math

from klippy.errors import CommandError
from klippy.gcode_command import Coord
from klippy.kinematics.limits import make_error
from klippy.mathutil import trilateration

# mm by which rounding may take the outermost point of an arc out of the room
ARC_SLACK = 1e-6


class ArmsMachine:
    """What deltas share: rails stepper_a, stepper_b, stepper_c, homed together.

    A kind sets min_z, max_z, the radius of its room and home_position.
    """

    def __init__(self, toolhead, config):
        self.printer = config.get_printer()
        self.max_velocity, self.max_accel = toolhead.get_max_velocity()
        self.max_z_velocity = config.getfloat(
            "max_z_velocity", self.max_velocity, above=0., maxval=self.max_velocity)
        self.is_homed = False
        self.printer.register_event_handler("stepper_enable:motor_off",
                                            self._handle_motor_off)

    def set_reach(self, radius):
        """The head may be so far from the middle, mm."""
        self.max_radius, self.max_radius2 = radius, radius ** 2

    def _handle_motor_off(self, print_time):
        self.clear_homing_state("xyz")

    # Positions

    def get_steppers(self):
        """All MCU_steppers."""
        return [motor for rail in self.rails for motor in rail.get_steppers()]

    def calc_position(self, stepper_positions):
        """[x, y, z] of the head for {stepper name: position}."""
        return self.calc_point([stepper_positions[rail.get_name()]
                                for rail in self.rails])

    def set_position(self, newpos, homing_axes=""):
        """The head is at newpos; all three axes ("xyz") become homed or none."""
        for rail in self.rails:
            rail.set_position(newpos)
        if len(set(homing_axes)) == 3:
            self.is_homed = True

    def clear_homing_state(self, clear_axes):
        """The machine must be homed again, whatever the axis."""
        if clear_axes:
            self.is_homed = False

    def note_z_not_homed(self):
        """Old name of clear_homing_state("z")."""
        self.clear_homing_state("z")

    # Moves

    def is_inside(self, move):
        """True if the machine is homed and the move ends in its room."""
        return (self.is_homed and move.end_z >= self.min_z
                and move.end_x * move.end_x + move.end_y * move.end_y
                <= self.max_radius2)

    def refuse(self, move):
        """Raise the error of a move; axes that rest may be outside."""
        if not self.is_homed:
            raise make_error(move, "Must home axis first", "no axis is homed")
        if move.end_z < self.min_z and move.d_z != 0.:
            raise make_error(move, "Move out of range", "Z %.3f is below %.3f"
                             % (move.end_z, self.min_z))
        radius = math.hypot(move.end_x, move.end_y)
        if radius > self.max_radius and (move.d_x != 0. or move.d_y != 0.):
            raise make_error(move, "Move out of range", "%.3f from the center is more"
                             " than %.3f" % (radius, self.max_radius))

    def find_arc_reach(self, move):
        """How far from the middle an arc leads, mm.  Raises CommandError if too far."""
        _, reach = move.arc.find_nearest(0., 0.)
        if not self.is_homed or move.end_z < self.min_z:
            self.refuse(move)
        if reach > self.max_radius + ARC_SLACK:
            raise make_error(move, "Move out of range", "the arc goes to %.3f from the"
                             " center, which is more than %.3f"
                             % (reach, self.max_radius))
        return reach

    def get_status(self, eventtime):
        """Status of printer.toolhead: homed_axes and ranges."""
        edge = self.max_radius
        return {"homed_axes": "xyz" if self.is_homed else "",
                "axis_minimum": Coord(-edge, -edge, self.min_z, 0.),
                "axis_maximum": Coord(edge, edge, self.max_z, 0.)}


def find_meeting(centers, lengths2, held_by):
    """[x, y, z] of a head on three arms that end at centers (x, y, z), mm.

    lengths2: squares of their lengths, mm^2.  Raises CommandError if they do
    not meet, which tells what the head is held_by.
    """
    try:
        return trilateration(centers, lengths2)
    except ValueError as err:
        raise CommandError("No head is held by %s: %s" % (held_by, err)) from None
