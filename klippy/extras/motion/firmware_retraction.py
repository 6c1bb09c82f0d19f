# SPDX-License-Identifier: GPL-3.0-or-later
"""[firmware_retraction]: G10 draws filament back, G11 brings it forth again.

The extruder position that G-code sees does not change.  What was drawn back is
remembered for each extruder, so that G11 returns just that (and the extra
length), whatever was changed in between.
"""

from klippy.extras.retract_lift import RetractLift

# option: (default, least value)
OPTIONS = {"retract_length": (0., 0.), "retract_speed": (20., 1.),
           "unretract_extra_length": (0., 0.),
           "unretract_speed": (10., 1.), "z_hop_height": (0., 0.)}


class FirmwareRetraction:
    """Lengths are mm of filament, speeds mm/s times the speed factor of M220."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.options = {name: config.getfloat(name, default, minval=least)
                        for name, (default, least) in OPTIONS.items()}
        self.config_options = self.options
        self.drawn_back = {}        # extruder name -> mm
        self.gcode_move = self.printer.load_object(config, "gcode_move")
        self.lift = RetractLift(
            self.printer, self.gcode_move,
            config.getboolean("clear_zhop_on_z_moves", False))
        self._register_commands()

    def _register_commands(self):
        gcode = self.printer.lookup_object("gcode")
        for name in ("SET_RETRACTION", "GET_RETRACTION", "CLEAR_RETRACTION",
                     "RESET_RETRACTION"):
            gcode.register_command(name, getattr(self, "cmd_" + name),
                                   desc=getattr(self, "cmd_%s_help" % (name,)))
        gcode.register_command("G10", self.cmd_G10)
        gcode.register_command("G11", self.cmd_G11)

    def get_status(self, eventtime):
        """The settings (mm, mm/s), what G11 will return, what is done now."""
        name = self._get_extruder_name()
        drawn = self.drawn_back.get(name, self.options["retract_length"])
        return {**self.options,
                "unretract_length": drawn + self.options["unretract_extra_length"],
                "retract_state": name in self.drawn_back,
                "zhop_state": bool(self.lift.lift)}

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
            "%s=%.5f" % (name.upper(), value) for name, value in self.options.items()
            if name != "z_hop_height" or value))

    cmd_CLEAR_RETRACTION_help = "Take all filament to be where it was before G10"

    def cmd_CLEAR_RETRACTION(self, gcmd):
        """Forget what is drawn back and lifted; nothing moves."""
        self.drawn_back = {}
        self.lift.forget()

    cmd_RESET_RETRACTION_help = "Undo what SET_RETRACTION has changed"

    def cmd_RESET_RETRACTION(self, gcmd):
        """Use the options of the config file again."""
        self.options = self.config_options

    def cmd_G10(self, gcmd):
        """Draw filament back and go up; nothing if it is drawn back."""
        name, length = self._get_extruder_name(), self.options["retract_length"]
        if name not in self.drawn_back:
            self._move_filament(-length, self.options["retract_speed"])
            self.drawn_back[name] = length
            self.lift.change(self.options["z_hop_height"])

    def cmd_G11(self, gcmd):
        """Go down, bring back what was drawn back, and the extra length."""
        name = self._get_extruder_name()
        self.lift.change(0.)
        if name in self.drawn_back:
            length = self.drawn_back[name] + self.options["unretract_extra_length"]
            self._move_filament(length, self.options["unretract_speed"])
            del self.drawn_back[name]


def load_config(config):
    return FirmwareRetraction(config)
