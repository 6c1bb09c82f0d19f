# SPDX-License-Identifier: GPL-3.0-or-later
"""MPC_SET: other values for a heater under `control: mpc`, until restart."""

from klippy.extras.mpc_options import parse_filament_temp, parse_transfers
from klippy.record import replace

FILAMENT = {"FILAMENT_DIAMETER": "diameter", "FILAMENT_DENSITY": "density",
            "FILAMENT_HEAT_CAPACITY": "heat_capacity"}
PARAMETERS = {"BLOCK_HEAT_CAPACITY": "capacity",
              "SENSOR_RESPONSIVENESS": "responsiveness"}


class MpcSet:
    """The command of one heater."""

    def __init__(self, config, heater, control):
        self.heater, self.control = heater, control
        config.get_printer().lookup_object("gcode").register_mux_command(
            "MPC_SET", "HEATER", heater.short_name, self.cmd_MPC_SET,
            desc=self.cmd_MPC_SET_help)

    cmd_MPC_SET_help = "Set values of a heater's model until the next restart"

    def cmd_MPC_SET(self, gcmd):
        filament = self._read_filament(gcmd)
        parameters = self._read_parameters(gcmd)
        with self.heater.lock:
            self.control.filament = filament
            if parameters != self.control.parameters:
                self.control.apply_parameters(parameters)

    def _read_filament(self, gcmd):
        now = self.control.filament
        changes = {field: gcmd.get_float(name, getattr(now, field), above=0.0)
                   for name, field in FILAMENT.items()}
        text = gcmd.get("FILAMENT_TEMP", None)
        if text is not None:
            changes["temp_source"] = self._parse(
                gcmd, "FILAMENT_TEMP", text, parse_filament_temp,
                "SENSOR, AMBIENT or degrees")
        has_sensor = self.control.surroundings.sensor is not None
        if changes.get("temp_source") == "sensor" and not has_sensor:
            raise gcmd.error("FILAMENT_TEMP=SENSOR needs an ambient_temp_sensor in"
                             " section '%s'" % (self.heater.name,))
        return replace(now, **changes)

    def _read_parameters(self, gcmd):
        now = self.control.parameters
        changes = {field: gcmd.get_float(name, getattr(now, field), above=0.0)
                   for name, field in PARAMETERS.items()}
        changes["transfer"] = gcmd.get_float(
            "AMBIENT_TRANSFER", now.transfer, minval=0.0)
        text = gcmd.get("FAN_AMBIENT_TRANSFER", None)
        if text is not None:
            changes["fan_transfers"] = self._parse(
                gcmd, "FAN_AMBIENT_TRANSFER", text, parse_transfers,
                "numbers from 0 on with commas between them")
        return replace(now, **changes)

    def _parse(self, gcmd, name, text, parse, what):
        try:
            return parse(text)
        except ValueError as e:
            raise gcmd.error("MPC_SET HEATER=%s: %s must be %s, not '%s'" % (
                self.heater.short_name, name, what, text)) from e
