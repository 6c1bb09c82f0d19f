# SPDX-License-Identifier: GPL-3.0-or-later
"""[firmware_retraction]: G10 draws filament back, G11 brings it forth again.

The extruder position that G-code sees does not change.  What was drawn back is
remembered for each extruder, so that G11 returns just that (and the extra
length), whatever was changed in between.
"""

# option: (default, least value)
OPTIONS = {"retract_length": (0., 0.), "retract_speed": (20., 1.),
           "unretract_extra_length": (0., 0.),
           "unretract_speed": (10., 1.)}


class FirmwareRetraction:
    """Lengths are mm of filament, speeds mm/s times the speed factor of M220."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.options = {name: config.getfloat(name, default, minval=least)
                        for name, (default, least) in OPTIONS.items()}
        self.drawn_back = {}        # extruder name -> mm
        self.gcode_move = self.printer.load_object(config, "gcode_move")
        self._register_commands()

    def _register_commands(self):
        gcode = self.printer.lookup_object("gcode")
        gcode.register_command("SET_RETRACTION", self.cmd_SET_RETRACTION,
                               desc=self.cmd_SET_RETRACTION_help)
        gcode.register_command("GET_RETRACTION", self.cmd_GET_RETRACTION,
                               desc=self.cmd_GET_RETRACTION_help)
        gcode.register_command("G10", self.cmd_G10)
        gcode.register_command("G11", self.cmd_G11)

    def get_status(self, eventtime):
        """The four settings; mm and mm/s."""
        return dict(self.options)

    def _get_extruder_name(self):
        return self.printer.lookup_object("toolhead").get_extruder().get_name()

    def _move_filament(self, length, speed):
        """Move by so many mm of filament, unseen by the G-code's coordinates."""
        owner = self.gcode_move
        x, y, z, e = owner.last_position[:4]
        owner.make_move(x, y, z, e + length, speed * owner.speed_factor * 60.)
        owner.base_position[3] += length

    # Commands

    cmd_SET_RETRACTION_help = "Change the lengths and speeds of G10 and G11"

    def cmd_SET_RETRACTION(self, gcmd):
        """Set any of the options; what is drawn back now is not touched."""
        self.options = {
            name: gcmd.get_float(name.upper(), self.options[name], minval=least)
            for name, (_, least) in OPTIONS.items()}

    cmd_GET_RETRACTION_help = "Tell the lengths and speeds of G10 and G11"

    def cmd_GET_RETRACTION(self, gcmd):
        """Tell the options."""
        gcmd.respond_info(" ".join(
            "%s=%.5f" % (name.upper(), self.options[name]) for name in OPTIONS))

    def cmd_G10(self, gcmd):
        """Draw filament back; nothing if it is drawn back."""
        name, length = self._get_extruder_name(), self.options["retract_length"]
        if name not in self.drawn_back:
            self._move_filament(-length, self.options["retract_speed"])
            self.drawn_back[name] = length

    def cmd_G11(self, gcmd):
        """Bring back what was drawn back, and the extra length."""
        name = self._get_extruder_name()
        if name in self.drawn_back:
            length = self.drawn_back[name] + self.options["unretract_extra_length"]
            self._move_filament(length, self.options["unretract_speed"])
            del self.drawn_back[name]


def load_config(config):
    return FirmwareRetraction(config)
