# SPDX-License-Identifier: GPL-3.0-or-later
"""A printer whose toolhead only notes the moves, with the real G-code objects."""

import front_end

from klippy.errors import CommandError
from klippy.toolhead import ToolHead


class NotingToolhead(ToolHead):
    """Takes every move up to x = 1000 and notes it, and by which way it came."""

    def __init__(self):
        self.position, self.moves, self.ways = [0.] * 4, [], []
        self.axes = []

    def get_position(self):
        return list(self.position)

    def get_extra_axes(self):
        return [None, None, None, None, *self.axes]

    def move_xyze(self, x, y, z, e, speed):
        self.ways.append("plain")
        self.note([x, y, z, e], speed)
        return 0

    def note(self, newpos, speed):
        if newpos[0] > 1000.:
            raise CommandError("Move out of range")
        self.position = list(newpos)
        self.moves.append((*newpos, speed))


class ListToolhead(NotingToolhead):
    """With a move() of its own, so that plain numbers must not pass it by."""

    def move(self, newpos, speed):
        self.ways.append("list")
        self.note(newpos, speed)


class ExtraAxis:
    def __init__(self, letter):
        self.letter = letter

    def get_axis_gcode_id(self):
        return self.letter


def make_printer(*sections, toolhead=None):
    """A ready front_end printer; .toolhead and .gcode_move are set."""
    printer = front_end.Printer()
    printer.toolhead = toolhead or NotingToolhead()
    printer.gcode_move = printer.load("gcode_move")
    printer.add_object("toolhead", printer.toolhead)
    for name, options in sections:
        printer.load(name, **options)
    printer.make_ready()
    return printer
