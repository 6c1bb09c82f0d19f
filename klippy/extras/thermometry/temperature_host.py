# SPDX-License-Identifier: GPL-3.0-or-later
"""sensor_type temperature_host: a temperature that the host's kernel reports.

The file holds thousandths of a degC, as those of /sys/class/thermal do.  On a
simulated machine without that file it is the room's temperature.
"""
import logging

from klippy.extras.polled_sensor import PolledSensor

DEFAULT_PATH = "/sys/class/thermal/thermal_zone0/temp"


class TemperatureHost(PolledSensor):
    """A sensor; status: temperature in degC."""

    report_time = 1.0

    def __init__(self, config):
        super().__init__(config)
        printer = self.printer
        self.name = self.section.split()[-1]
        self.path = config.get("sensor_path", DEFAULT_PATH)
        self.temp = 0.0
        self.is_failing = False
        self.room = self._find_room()
        printer.add_object("temperature_host " + self.name, self)
        if self.is_live():
            self._check_file(config)
            printer.register_event_handler("klippy:connect", self._start)

    def _find_room(self):
        machine = self.printer.get_start_args().get("machine")
        return None if machine is None else machine.options.ambient_temp

    def _check_file(self, config):
        try:
            self._read()
        except (OSError, ValueError) as err:
            raise config.error(
                "Section '%s': no temperature can be read from '%s' (%s); set"
                " sensor_path" % (self.section, self.path, err)) from err

    def _start(self):
        self.reactor.update_timer(self.timer, self.reactor.NOW)

    def _read(self):
        """degC.  Raises OSError or ValueError."""
        try:
            with open(self.path, encoding="ascii") as file:
                return float(file.read()) / 1000.0
        except FileNotFoundError:
            if self.room is None or self.path != DEFAULT_PATH:
                raise
            return self.room

    def _report(self, eventtime):
        try:
            self.temp = self._read()
        except (OSError, ValueError) as err:
            if not self.is_failing:
                logging.warning("[%s]: %s: %s", self.section, self.path, err)
            self.is_failing = True
            return eventtime + self.report_time
        self.is_failing = False
        low, high = self.range
        if not low <= self.temp <= high:
            self.printer.invoke_shutdown(
                "Sensor of '%s' (temperature_host) reads %.1f degC, outside its range"
                " %.1f..%.1f" % (self.section, self.temp, low, high))
            return self.reactor.NEVER
        return self._deliver(eventtime, self.temp)

    def get_status(self, eventtime):
        return {"temperature": round(self.temp, 2)}


def load_config(config):
    config.get_printer().load_object(config, "heaters").add_sensor_factory(
        "temperature_host", TemperatureHost)
