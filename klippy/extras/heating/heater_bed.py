# SPDX-License-Identifier: GPL-3.0-or-later
"""[heater_bed]: the bed's heater with M140 and M190."""


class PrinterHeaterBed:
    """The bed; its status is its heater's."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.heaters = self.printer.load_object(config, "heaters")
        self.heater = self.heaters.setup_heater(config, "B")
        self.get_status = self.heater.get_status
        self.stats = self.heater.stats
        gcode = self.printer.lookup_object("gcode")
        gcode.register_command("M140", self.cmd_M140)
        gcode.register_command("M190", self.cmd_M190)

    def cmd_M140(self, gcmd, wait=False):
        """Set the bed's temperature."""
        target = gcmd.get_float("S", 0.0)
        self.heaters.set_temperature(self.heater, target, wait)

    def cmd_M190(self, gcmd):
        """Set the bed's temperature and wait for it."""
        self.cmd_M140(gcmd, wait=True)


def load_config(config):
    return PrinterHeaterBed(config)
