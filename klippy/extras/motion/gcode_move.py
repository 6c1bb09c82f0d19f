# SPDX-License-Identifier: GPL-3.0-or-later
"""G-code coordinates: from the numbers of a move to the position of the head.

A plain G0/G1 line comes as scanned numbers and goes on as numbers; all else
passes through cmd_G1().  See docs/internals/gcode_move.md.
"""

import logging
import math

from klippy.errors import CommandError
from klippy.extras.gcode_position import PositionCommands
from klippy.gcode import Coord, MoveSink
from klippy.toolhead import ToolHead

AXES = "XYZE"
# Letters of a G-code line that cannot name a further axis
RESERVED_LETTERS = "FNGMT"
START_SPEED = 25.           # mm/s, before the first F


class GCodeMove(MoveSink):
    """The G-code position and its modes, offsets and factors.

    Position of the head = number * factor + base_position for absolute
    numbers; plug-ins read and assign the fields.
    """

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.gcode = printer.lookup_object("gcode")
        self.is_printer_ready = False
        self.absolute_coord = self.absolute_extrude = True
        self.base_position = [0.] * 4
        self.last_position = [0.] * 4
        self.homing_position = [0.] * 4
        self.axis_map = {letter: i for i, letter in enumerate(AXES)}
        self.speed, self.speed_factor, self.extrude_factor = START_SPEED, 1. / 60., 1.
        self.saved_states = {}
        self.move_transform = self.plain_toolhead = None
        self._move_with_transform = None
        self.position_with_transform = lambda: [0.] * 4
        self._register_events()
        self._register_commands()
        self.gcode.set_move_sink(self)

    def _register_events(self):
        register = self.printer.register_event_handler
        register("klippy:ready", self._handle_ready)
        register("klippy:shutdown", self._handle_shutdown)
        for event in ("toolhead:set_position", "toolhead:manual_move",
                      "gcode:command_error"):
            register(event, self.reset_last_position)
        register("toolhead:update_extra_axes", self._update_extra_axes)
        register("extruder:activate_extruder", self._handle_activate_extruder)
        register("homing:home_rails_end", self._handle_home_rails_end)

    def _register_commands(self):
        register = self.gcode.register_command
        register("G0", self.cmd_G1)
        for name in ("G1", "G20", "G21", "G90", "G91", "G92", "M82", "M83", "M220",
                     "M221"):
            register(name, getattr(self, "cmd_" + name))
        PositionCommands(self).register()

    # Events

    def _handle_ready(self):
        self.is_printer_ready = True
        if self.move_transform is None:
            self._set_target(self.printer.lookup_object("toolhead"))
        self._update_extra_axes()

    def _handle_shutdown(self):
        if not self.is_printer_ready:
            return
        self.is_printer_ready = False
        logging.info(
            "G-code state: absolute_coord=%s absolute_extrude=%s base_position=%s"
            " last_position=%s homing_position=%s speed_factor=%s extrude_factor=%s"
            " speed=%s", self.absolute_coord, self.absolute_extrude,
            self.base_position, self.last_position, self.homing_position,
            self.speed_factor, self.extrude_factor, self.speed)

    def _handle_activate_extruder(self):
        self.reset_last_position()
        self.extrude_factor = 1.
        self.base_position[3] = self.last_position[3]

    def _handle_home_rails_end(self, homing_state, rails):
        self.reset_last_position()
        for axis in homing_state.get_axes():
            self.base_position[axis] = self.homing_position[axis]

    def _update_extra_axes(self):
        """Know the axes beyond x, y, z, e that the toolhead has now."""
        toolhead = self.printer.lookup_object("toolhead", None)
        axes = {letter: i for i, letter in enumerate(AXES)}
        further = [] if toolhead is None else toolhead.get_extra_axes()[4:]
        for index, axis in enumerate(further, 4):
            letter = axis.get_axis_gcode_id()
            if letter and letter not in axes and letter not in RESERVED_LETTERS:
                axes[letter] = index
        self.axis_map = axes
        self.base_position[4:] = [0.] * len(further)
        self.homing_position[4:] = [0.] * len(further)
        self.last_position[4:] = [0.] * len(further)
        self._find_plain_toolhead()
        self.reset_last_position()

    # Where moves go

    @property
    def move_with_transform(self):
        """move(newpos, speed) of the first transform or of the toolhead."""
        return self._move_with_transform

    @move_with_transform.setter
    def move_with_transform(self, move):
        self._move_with_transform = move
        self._find_plain_toolhead()

    def set_move_transform(self, transform, force=False):
        """Send moves to transform.move(newpos, speed) from now on.

        transform.get_position() gives the position it is at.  Returns the one
        that moves went to so far, for the transform to call.
        Raises ConfigError if there is one already and force is not set.
        """
        old = self.move_transform
        if old is not None and not force:
            raise self.printer.config_error(
                "The moves already have a transform (%s), there cannot be two"
                % (type(old).__name__,))
        if old is None:
            old = self.printer.lookup_object("toolhead", None)
        self.move_transform = transform
        self._set_target(transform)
        return old

    def _set_target(self, target):
        self.position_with_transform = target.get_position
        self.move_with_transform = target.move

    def _find_plain_toolhead(self):
        """Note whether plain moves may go to the toolhead as four numbers.

        Not if a plug-in has put something in the place of its move().
        """
        toolhead = self.printer.lookup_object("toolhead", None)
        is_plain = (isinstance(toolhead, ToolHead)
                    and type(toolhead).move is ToolHead.move
                    and "move" not in vars(toolhead)
                    and self._move_with_transform == toolhead.move
                    and len(self.base_position) == 4)
        self.plain_toolhead = toolhead if is_plain else None

    def find_arc_target(self):
        """The ToolHead, if positions get there as they are: else None.

        A transform may have a method passes_unchanged() that says so of itself;
        `next_transform` is where it passes them to.
        """
        if self.plain_toolhead is not None or self.move_transform is None:
            return self.plain_toolhead
        target = self.move_transform
        if self._move_with_transform != target.move or len(self.base_position) != 4:
            return None
        while not isinstance(target, ToolHead):
            passes = getattr(target, "passes_unchanged", None)
            if passes is None or not passes():
                return None
            target = target.next_transform
        is_replaced = type(target).move is not ToolHead.move or "move" in vars(target)
        return None if is_replaced else target

    def reset_last_position(self):
        """Read the position again after the head was moved by others."""
        if self.is_printer_ready:
            self.last_position = list(self.position_with_transform())

    # Moves

    def move_line(self, scan):
        """Make the plain move that scan holds.  Raises CommandError."""
        mask = scan.mask
        if mask & 16 and not scan.f > 0.:
            raise CommandError("Invalid speed in '%s': F is %s, it must be above 0"
                               % (describe(scan), format_number(scan.f)))
        x, y, z = self.last_position[0], self.last_position[1], self.last_position[2]
        e = self.last_position[3]
        if mask & 7:
            origin = self.base_position if self.absolute_coord else self.last_position
            if mask & 1:
                x = scan.x + origin[0]
            if mask & 2:
                y = scan.y + origin[1]
            if mask & 4:
                z = scan.z + origin[2]
        if mask & 8:
            origin = self.last_position
            if self.absolute_coord and self.absolute_extrude:
                origin = self.base_position
            e = scan.e * self.extrude_factor + origin[3]
        if mask & 16:
            self.speed = scan.f * self.speed_factor
        if mask & 15:
            self.make_move(x, y, z, e, self.speed)
        return 0

    def make_move(self, x, y, z, e, speed):
        """Move to a position of the head (mm) at a speed (mm/s).

        Axes beyond e go to their last_position.  Raises CommandError.
        """
        last = self.last_position
        last[0], last[1], last[2], last[3] = x, y, z, e
        is_done = False
        try:
            if self.plain_toolhead is not None:
                self.plain_toolhead.move_xyze(x, y, z, e, speed)
            else:
                self._move_with_transform(list(last), speed)
            is_done = True
        finally:
            if not is_done:
                self.reset_last_position()
        return 0

    def make_arc(self, toolhead, arc, e, speed):
        """Follow an ArcPath from the last position; toolhead: find_arc_target().

        Raises CommandError.
        """
        last = self.last_position
        last[0], last[1], last[2] = arc.end
        last[3] = e
        is_done = False
        try:
            toolhead.move_arc(arc, e, speed)
            is_done = True
        finally:
            if not is_done:
                self.reset_last_position()

    def cmd_G1(self, gcmd):
        """Move: X Y Z E and further axes, F in mm/min."""
        params = gcmd.get_command_parameters()
        newpos = list(self.last_position)
        named = [letter for letter in self.axis_map if letter in params]
        for letter in named:
            index = self.axis_map[letter]
            value, is_absolute = gcmd.get_float(letter), self.absolute_coord
            if letter == "E":
                value *= self.extrude_factor
                is_absolute = is_absolute and self.absolute_extrude
            origin = self.base_position if is_absolute else self.last_position
            newpos[index] = value + origin[index]
        if "F" in params:
            self.speed = self.read_speed(gcmd)
        if named:
            self.last_position = newpos
            self.make_move(*newpos[:4], self.speed)

    def read_speed(self, gcmd):
        """Speed in mm/s that the word F gives.  Raises CommandError."""
        value = gcmd.get_float("F")
        if value <= 0.:
            raise gcmd.error("Invalid speed in '%s': F is %s, it must be above 0"
                             % (gcmd.get_commandline(), format_number(value)))
        return value * self.speed_factor

    # Modes

    def cmd_G20(self, gcmd):
        raise gcmd.error("Machine does not support G20 (inches) command")

    def cmd_G21(self, gcmd):
        """Units are mm, always."""

    def cmd_G90(self, gcmd):
        self.absolute_coord = True

    def cmd_G91(self, gcmd):
        self.absolute_coord = False

    def cmd_M82(self, gcmd):
        self.absolute_extrude = True

    def cmd_M83(self, gcmd):
        self.absolute_extrude = False

    def cmd_G92(self, gcmd):
        """Give the position these coordinates; without any, all are 0."""
        given = {letter: gcmd.get_float(letter) for letter in self.axis_map
                 if gcmd.get(letter, None) is not None}
        for letter, index in self.axis_map.items():
            value = given.get(letter, None if given else 0.)
            if value is not None:
                factor = self.extrude_factor if letter == "E" else 1.
                self.base_position[index] = self.last_position[index] - value * factor

    def cmd_M220(self, gcmd):
        """Speed factor S in percent."""
        factor = gcmd.get_float("S", 100., above=0.) / (60. * 100.)
        self.speed = self.get_gcode_speed() * factor
        self.speed_factor = factor

    def cmd_M221(self, gcmd):
        """Extrude factor S in percent; the G-code's E stays what it is."""
        factor = gcmd.get_float("S", 100., above=0.) / 100.
        e = self.get_gcode_position()[3]
        self.base_position[3] = self.last_position[3] - e * factor
        self.extrude_factor = factor

    # Status

    def get_gcode_speed(self):
        """Speed as the G-code gave it, mm/min."""
        return self.speed / self.speed_factor

    def get_gcode_position(self):
        """Position in the coordinates of the G-code: list."""
        base = self.base_position
        position = [last - base[i] for i, last in enumerate(self.last_position)]
        position[3] /= self.extrude_factor
        return position

    def get_status(self, eventtime=None):
        return {"speed_factor": self.speed_factor * 60.,
                "speed": self.get_gcode_speed(),
                "extrude_factor": self.extrude_factor,
                "absolute_coordinates": self.absolute_coord,
                "absolute_extrude": self.absolute_extrude,
                "homing_origin": Coord(self.homing_position),
                "position": Coord(self.last_position),
                "gcode_position": Coord(self.get_gcode_position()),
                "axis_map": dict(self.axis_map)}


def format_number(value):
    """The shortest text of a float without exponent: 0, -1.5."""
    text = "%.6f" % (value,) if math.isfinite(value) else str(value)
    return text.rstrip("0").rstrip(".") if "." in text else text


def describe(scan):
    """A plain move line with the words of scan."""
    values = (scan.x, scan.y, scan.z, scan.e, scan.f)
    return " ".join(["G1"] + [letter + format_number(values[i]) for i, letter
                              in enumerate("XYZEF") if scan.mask & 1 << i])


def load_config(config):
    return GCodeMove(config)
