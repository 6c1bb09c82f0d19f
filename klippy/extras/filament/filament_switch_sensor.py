# SPDX-License-Identifier: GPL-3.0-or-later
"""[filament_switch_sensor name]: a switch that filament presses."""
from klippy.extras.filament_runout import RunoutHelper

# The printer goes on without it
MAY_LACK_FIRMWARE = True

__all__ = ["RunoutHelper", "SwitchSensor"]


class SwitchSensor:
    """Status as RunoutHelper."""

    def __init__(self, config):
        printer = config.get_printer()
        buttons = printer.load_object(config, "buttons")
        part = buttons.register_debounce_button(
            config.get("switch_pin"), self._handle_switch, config)
        self.runout_helper = RunoutHelper(config)
        self.runout_helper.part = part
        self.get_status = self.runout_helper.get_status

    def _handle_switch(self, eventtime, state):
        self.runout_helper.note_filament_present(eventtime, bool(state))


def load_config_prefix(config):
    return SwitchSensor(config)
