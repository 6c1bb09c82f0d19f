# SPDX-License-Identifier: GPL-3.0-or-later
"""[extruder_stepper name]: one more motor that follows an extruder."""
from klippy.kinematics.extruder import ExtruderStepper


class PrinterExtruderStepper:
    """A motor that follows the extruder its section names."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.extruder_stepper = ExtruderStepper(config)
        self.extruder_name = config.get("extruder")
        self.get_status = self.extruder_stepper.get_status
        self.find_past_position = self.extruder_stepper.find_past_position
        self.printer.register_event_handler("klippy:connect",
                                            self._handle_connect)

    def _handle_connect(self):
        if self.extruder_name:
            self.extruder_stepper.sync_to_extruder(self.extruder_name)


def load_config_prefix(config):
    return PrinterExtruderStepper(config)
