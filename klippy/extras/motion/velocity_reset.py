# SPDX-License-Identifier: GPL-3.0-or-later
"""RESET_VELOCITY_LIMIT: the limits of [printer], as the config has them."""


class VelocityReset:
    """Keeps the limits that the tool head has begun with."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.toolhead = self.limits = None
        printer.register_event_handler("klippy:connect", self._handle_connect)
        printer.lookup_object("gcode").register_command(
            "RESET_VELOCITY_LIMIT", self.cmd_RESET_VELOCITY_LIMIT,
            desc=self.cmd_RESET_VELOCITY_LIMIT_help, yields=True)

    def _handle_connect(self):
        self.toolhead = self.printer.lookup_object("toolhead")
        self.limits = self.toolhead.limits

    cmd_RESET_VELOCITY_LIMIT_help = "Undo what SET_VELOCITY_LIMIT and M204 have changed"

    def cmd_RESET_VELOCITY_LIMIT(self, gcmd):
        """Use the limits of the config for the moves to come, and tell them."""
        limits = self.limits
        self.toolhead.set_max_velocities(
            limits.max_velocity, limits.max_accel, limits.corner_velocity,
            limits.min_cruise_ratio)
        gcmd.respond_info(self.toolhead.note_limits(), log=False)


def load_config(config):
    return VelocityReset(config)
