# SPDX-License-Identifier: GPL-3.0-or-later
"""TUNING_TOWER: changes one parameter of a command with the height of a print.

The height is that of the G-code, looked at whenever filament is laid down.
"""

import math
from collections import namedtuple

# A print that starts this far (mm) below what was printed is another one
RESTART_DROP = 2.


class Tower(namedtuple("Tower", (
        "start", "factor", "band", "step_delta", "step_height", "skip"))):
    """What the parameter is at a height; all heights in mm.

    Steps of step_delta every step_height, else `factor` a mm; within bands of
    a height it stays what it is in their middle.
    """
    __slots__ = ()

    def calc_value(self, z):
        """Value of the parameter at a height z."""
        z = max(0., z - self.skip)
        if self.step_height:
            return self.start + self.step_delta * math.floor(z / self.step_height)
        if self.band:
            z = (math.floor(z / self.band) + .5) * self.band
        return self.start + self.factor * z

    def describe(self):
        """The settings that are used, as text."""
        names = ["start"]
        names += (["step_delta", "step_height"] if self.step_height
                  else ["factor", "band"] if self.band else ["factor"])
        names += ["skip"] if self.skip else []
        return " ".join("%s=%.6f" % (name, getattr(self, name)) for name in names)


class TuningTower:
    """Object tuning_tower; while a tower is printed, a transform of the moves."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.gcode = self.printer.lookup_object("gcode")
        self.gcode_move = self.printer.load_object(config, "gcode_move")
        self.next_transform = self.tower = None
        self.command = ""           # "M204 S", "SET_PRESSURE_ADVANCE ADVANCE="
        self.last_position = [0.] * 4
        self.last_z = self.last_value = None
        self.gcode.register_command("TUNING_TOWER", self.cmd_TUNING_TOWER,
                                    desc=self.cmd_TUNING_TOWER_help)

    # The transform

    def get_position(self):
        """Position of the head: nothing is shifted here."""
        position = self.next_transform.get_position()
        self.last_position = list(position)
        return position

    def move(self, newpos, speed):
        """Pass a move on, after the command if it is due."""
        target = self.next_transform
        if (self.tower is not None and newpos[2] != self.last_z
                and self._is_laying_down(newpos)):
            self._note_height(newpos[2])
        self.last_position = list(newpos)
        target.move(newpos, speed)

    def _is_laying_down(self, newpos):
        last = self.last_position
        return newpos[3] > last[3] and list(newpos[:3]) != last[:3]

    def _note_height(self, z):
        """Filament is laid down at another height of the head than before."""
        if self.last_z is not None and z < self.last_z - RESTART_DROP:
            self.end()
            return
        self.last_z = z
        value = self.tower.calc_value(self.gcode_move.get_gcode_position()[2])
        if value != self.last_value:
            self.last_value = value
            self.gcode.run_script_from_command("%s%.9f" % (self.command, value))

    # Begin and end

    def is_active(self):
        """True while a tower is printed."""
        return self.tower is not None

    def begin(self, command, parameter, tower):
        """Start a tower, in the place of one that may be there."""
        if self.is_active():
            self.end()
        joint = "%s %s" if self.gcode.is_traditional_gcode(command) else "%s %s="
        self.command = joint % (command, parameter)
        self.tower, self.last_z, self.last_value = tower, None, None
        if self.next_transform is None:
            self.next_transform = self.gcode_move.set_move_transform(self, force=True)
        self.get_position()

    def end(self):
        """Let the parameter be."""
        self.gcode.respond_info("Ending tuning test mode")
        self.tower = None
        # else others rely on the place it has among the transforms
        if self.gcode_move.move_transform is self:
            self.gcode_move.set_move_transform(self.next_transform, force=True)
            self.next_transform = None

    cmd_TUNING_TOWER_help = "Change a parameter of a command with the height"

    def cmd_TUNING_TOWER(self, gcmd):
        """Set PARAMETER of COMMAND by the height from now on."""
        command, parameter = gcmd.get("COMMAND"), gcmd.get("PARAMETER")
        tower = Tower(
            gcmd.get_float("START", 0.), gcmd.get_float("FACTOR", 0.),
            gcmd.get_float("BAND", 0., minval=0.), gcmd.get_float("STEP_DELTA", 0.),
            gcmd.get_float("STEP_HEIGHT", 0., minval=0.),
            gcmd.get_float("SKIP", 0., minval=0.))
        if (tower.factor or tower.band) and (tower.step_height or tower.step_delta):
            raise gcmd.error("Cannot specify both FACTOR (or BAND) and"
                             " STEP_DELTA/STEP_HEIGHT")
        if bool(tower.step_height) != bool(tower.step_delta):
            raise gcmd.error("Must specify both STEP_DELTA and STEP_HEIGHT")
        self.begin(command, parameter, tower)
        gcmd.respond_info("Starting tuning test (%s)" % (tower.describe(),))


def load_config(config):
    return TuningTower(config)
