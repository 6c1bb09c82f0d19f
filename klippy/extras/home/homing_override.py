# SPDX-License-Identifier: GPL-3.0-or-later
"""[homing_override]: G-code of the user in place of G28."""


class HomingOverride:
    """Runs the template; a G28 within it is the ordinary one."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.start_position = [config.getfloat("set_position_" + axis, None)
                               for axis in "xyz"]
        self.axes = config.get("axes", "XYZ").upper()
        self.template = self.printer.load_object(
            config, "gcode_macro").load_template(config, "gcode")
        self.is_running = False
        self.printer.load_object(config, "homing")
        self.gcode = self.printer.lookup_object("gcode")
        self.plain_g28 = self.gcode.register_command("G28", None)
        self.gcode.register_command("G28", self.cmd_G28)

    def _is_meant(self, gcmd):
        """Whether the G28 homes an axis of ours, or all."""
        named = [axis for axis in "XYZ" if gcmd.get(axis, None) is not None]
        return not named or any(axis in self.axes for axis in named)

    def cmd_G28(self, gcmd):
        """Home by the template, or the ordinary way."""
        if self.is_running or not self._is_meant(gcmd):
            self.plain_g28(gcmd)
            return
        self._set_start_position()
        context = self.template.create_template_context()
        context["params"] = gcmd.get_command_parameters()
        context["rawparams"] = gcmd.get_raw_command_parameters()
        try:
            self.is_running = True
            self.template.run_gcode_from_command(context)
        finally:
            self.is_running = False

    def _set_start_position(self):
        toolhead = self.printer.lookup_object("toolhead")
        position, axes = toolhead.get_position(), ""
        for index, value in enumerate(self.start_position):
            if value is not None:
                position[index] = value
                axes += "xyz"[index]
        if axes:
            toolhead.set_position(position, homing_axes=axes)


def load_config(config):
    return HomingOverride(config)
