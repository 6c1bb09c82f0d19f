# SPDX-License-Identifier: GPL-3.0-or-later
"""An axis of G1 moves beyond x, y, z and e, with the limits of its own motor."""

import math

from klippy.errors import CommandError
from klippy_ext.trapq import TrapMove

# Letters of a G1 line that mean something else
TAKEN_LETTERS = "XYZEFGMNT"


def read_letter(text):
    """A letter for an axis.  Raises CommandError."""
    if len(text) != 1 or not "A" <= text <= "Z" or text in TAKEN_LETTERS:
        raise CommandError(
            "'%s' is not a valid GCODE_AXIS: it must be one letter from A to Z, but"
            " none of %s" % (text, " ".join(TAKEN_LETTERS)))
    return text


class GCodeAxis:
    """What the toolhead knows about an extra axis; mm, mm/s, mm/s^2."""

    def __init__(self, name, letter, trapq, note_move):
        """note_move(print_time of the end, position there): called for each move."""
        self.name, self.letter, self.trapq = name, letter, trapq
        self.note_move = note_move
        self.max_velocity = self.max_accel = self.max_accel_alone = math.inf
        self.corner_velocity = 0.
        self.position_min, self.position_max = -math.inf, math.inf
        self.segment = TrapMove()

    def get_name(self):
        """Name of the section."""
        return self.name

    def get_axis_gcode_id(self):
        """Letter of the axis."""
        return self.letter

    def get_trapq(self):
        """The TrapQ of the axis."""
        return self.trapq

    def check_move(self, move, axis_index):
        """Raises CommandError out of range; slows the move to the axis's limits."""
        end, ratio = move.end_pos[axis_index], abs(move.axes_r[axis_index])
        if not self.position_min <= end <= self.position_max:
            raise move.move_error("Move out of range of axis %s" % (self.letter,))
        accel = self.max_accel
        if not move.is_kinematic_move:
            accel = min(accel, self.max_accel_alone)
        move.limit_speed(self.max_velocity / ratio, accel / ratio)

    def calc_junction(self, prev_move, move, axis_index):
        """Square of the speed at which the axis may change its pace."""
        change = abs(move.axes_r[axis_index] - prev_move.axes_r[axis_index])
        if change == 0.:
            return move.max_cruise_v2
        return (self.corner_velocity / change) ** 2

    def process_move(self, print_time, move, axis_index):
        """Put the axis's part of a planned move on its queue."""
        ratio = move.axes_r[axis_index]
        pace, segment = abs(ratio), self.segment
        segment.accel_t, segment.cruise_t = move.accel_t, move.cruise_t
        segment.decel_t = move.decel_t
        segment.start_x = move.start_pos[axis_index]
        segment.axes_r_x = math.copysign(1., ratio)
        segment.start_v, segment.cruise_v = move.start_v * pace, move.cruise_v * pace
        segment.accel = move.accel * pace
        self.trapq.append(print_time, segment)
        self.note_move(print_time + move.accel_t + move.cruise_t + move.decel_t,
                       move.end_pos[axis_index])
