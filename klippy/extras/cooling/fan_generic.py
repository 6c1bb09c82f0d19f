# SPDX-License-Identifier: GPL-3.0-or-later
"""[fan_generic name]: a fan commanded by SET_FAN_SPEED."""
from klippy.extras import fan, template_evaluator

# The printer goes on without it
MAY_LACK_FIRMWARE = True


class PrinterFanGeneric:
    """A fan with a name; status as in Fan."""

    def __init__(self, config):
        self.fan = fan.Fan(config, default_shutdown_speed=0.0)
        self.fan_name = config.get_name().split()[-1]
        self.get_status = self.fan.get_status
        printer = config.get_printer()
        self.evaluator = printer.load_object(config, "template_evaluator")
        gcode = printer.lookup_object("gcode")
        gcode.register_mux_command(
            "SET_FAN_SPEED", "FAN", self.fan_name, self.cmd_SET_FAN_SPEED,
            desc=self.cmd_SET_FAN_SPEED_help)

    cmd_SET_FAN_SPEED_help = "Sets the speed of a fan"

    def cmd_SET_FAN_SPEED(self, gcmd):
        speed = gcmd.get_float("SPEED", None, minval=0.0)
        template = gcmd.get("TEMPLATE", None)
        if (speed is None) == (template is None):
            raise gcmd.error("SET_FAN_SPEED FAN=%s needs either SPEED or TEMPLATE"
                             % (self.fan_name,))
        if template is not None:
            self.evaluator.set_template(gcmd, self, self._show_text)
            return
        self.evaluator.remove(self)
        self.fan.set_speed_from_command(speed)

    # as M107 is
    cmd_SET_FAN_SPEED.is_harmless = lambda gcmd: gcmd.get_float("SPEED", 1.0) <= 0.0

    def _show_text(self, text):
        self.fan.set_speed(template_evaluator.read_number(text, 1.0))


def load_config_prefix(config):
    return PrinterFanGeneric(config)
