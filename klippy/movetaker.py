# SPDX-License-Identifier: GPL-3.0-or-later
"""Who takes the part of a move that is beyond x, y, z."""


class MoveTaker:
    """The axis of an extruder: what the toolhead calls for each move, typed.

    An extruder of another class is called by name.
    """

    def check_move(self, move, axis_index):
        """Raises CommandError if the axis must not move so; may slow the move."""
        raise NotImplementedError

    def calc_junction(self, prev_move, move, axis_index):
        """Square of the speed at which the axis may change its pace."""
        raise NotImplementedError

    def process_move(self, print_time, move, axis_index):
        """Put the axis's part of a planned move on its queue."""
        raise NotImplementedError
