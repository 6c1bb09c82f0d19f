# SPDX-License-Identifier: GPL-3.0-or-later
"""[fan_generic name]: a fan commanded by SET_FAN_SPEED."""
from klippy.extras import fan


class PrinterFanGeneric:
    """A fan with a name; status as in Fan."""

    def __init__(self, config):
        self.fan = fan.Fan(config, default_shutdown_speed=0.0)
        self.fan_name = config.get_name().split()[-1]
        self.get_status = self.fan.get_status
        gcode = config.get_printer().lookup_object("gcode")
        gcode.register_mux_command(
            "SET_FAN_SPEED", "FAN", self.fan_name, self.cmd_SET_FAN_SPEED,
            desc=self.cmd_SET_FAN_SPEED_help)

    cmd_SET_FAN_SPEED_help = "Sets the speed of a fan"

    def cmd_SET_FAN_SPEED(self, gcmd):
        self.fan.set_speed_from_command(gcmd.get_float("SPEED", minval=0.0))


def load_config_prefix(config):
    return PrinterFanGeneric(config)
