# SPDX-License-Identifier: GPL-3.0-or-later
"""[safe_z_home]: lifts z before homing and homes z at a given place."""


class SafeZHome:
    """Takes the place of G28 and calls the ordinary one for each step."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.home_xy = config.getfloatlist("home_xy_position", count=2)
        self.z_hop = config.getfloat("z_hop", 0.)
        self.z_hop_speed = config.getfloat("z_hop_speed", 15., above=0.)
        self.speed = config.getfloat("speed", 50., above=0.)
        self.move_to_previous = config.getboolean("move_to_previous", False)
        self.is_y_first = config.getboolean("home_y_before_x", False)
        self._check_z_hop(config)
        if config.has_section("homing_override"):
            raise config.error("[safe_z_home] and [homing_override] both take the"
                               " place of G28: remove one of them")
        self.printer.load_object(config, "homing")
        self.gcode = self.printer.lookup_object("gcode")
        self.plain_g28 = self.gcode.register_command("G28", None)
        self.gcode.register_command("G28", self.cmd_G28)

    def _check_z_hop(self, config):
        """Errors for a lift that leads out of the machine."""
        if not config.has_section("stepper_z"):
            return
        max_z = config.getsection("stepper_z").getfloat(
            "position_max", None, note_valid=False)
        if max_z is not None and self.z_hop > max_z:
            raise config.error("z_hop %s of [safe_z_home] is above position_max %s of"
                               " [stepper_z]" % (self.z_hop, max_z))

    def _get_homed_axes(self):
        eventtime = self.printer.get_reactor().monotonic()
        return self.printer.lookup_object("toolhead").get_status(
            eventtime)["homed_axes"]

    def _lift(self):
        """Lift z by z_hop where it is not known, else to z_hop at least."""
        if not self.z_hop:
            return
        toolhead = self.printer.lookup_object("toolhead")
        if "z" in self._get_homed_axes():
            if toolhead.get_position()[2] < self.z_hop:
                toolhead.manual_move([None, None, self.z_hop], self.z_hop_speed)
            return
        position = toolhead.get_position()
        position[2] = 0.
        toolhead.set_position(position, homing_axes="z")
        toolhead.manual_move([None, None, self.z_hop], self.z_hop_speed)
        toolhead.get_kinematics().clear_homing_state("z")

    def _home(self, axes):
        self.plain_g28(self.gcode.create_gcode_command(
            "G28", "G28 " + " ".join(axes), dict.fromkeys(axes, "0")))

    def cmd_G28(self, gcmd):
        """Home the axes named, or all: x and y first, then z at its place."""
        axes = [axis for axis in "XYZ" if gcmd.get(axis, None) is not None] or "XYZ"
        self._lift()
        flat = [axis for axis in axes if axis != "Z"]
        if self.is_y_first and len(flat) == 2:
            self._home("Y")
            self._home("X")
        elif flat:
            self._home(flat)
        if "Z" in axes:
            self._home_z(gcmd)

    def _home_z(self, gcmd):
        if not {"x", "y"} <= set(self._get_homed_axes()):
            raise gcmd.error("Must home X and Y axes first")
        toolhead = self.printer.lookup_object("toolhead")
        previous = toolhead.get_position()
        toolhead.manual_move(list(self.home_xy), self.speed)
        self._home(["Z"])
        self._lift()
        if self.move_to_previous:
            toolhead.manual_move(previous[:2], self.speed)


def load_config(config):
    return SafeZHome(config)
