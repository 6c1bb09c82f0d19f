# SPDX-License-Identifier: GPL-3.0-or-later
"""Sensors that read the model of a heater under `control: mpc`.

A heater without a model (another control, not measured yet, in MPC_CALIBRATE)
has the temperature of its own sensor, and a usual room around it.
"""
from klippy.extras.control_mpc import USUAL_ROOM
from klippy.extras.polled_sensor import PolledSensor


class MpcTemperature(PolledSensor):
    """A sensor of one heater's model; kinds say which temperature it reads.

    With ignore_limits it does not shut down outside of them.
    """

    what = ""

    def __init__(self, config):
        super().__init__(config)
        printer = self.printer
        self.heater_name = config.get("heater_name")
        self.is_free = config.getboolean("ignore_limits", False)
        self.is_loud = config.getboolean("echo_limits_to_console", False)
        self.is_outside = False
        self.heater = None
        printer.register_event_handler("klippy:connect", self._handle_connect)
        printer.register_event_handler("klippy:ready", self._handle_ready)

    def _handle_connect(self):
        heaters = self.printer.lookup_object("heaters")
        for heater in heaters.heaters.values():
            if heater.sensor is self:
                raise self.printer.config_error(
                    "Option 'sensor_type' in section '%s': a heater needs a sensor"
                    " that measures, not the model of a heater" % (self.section,))
        self.heater = heaters.lookup_heater(self.heater_name.split()[-1])

    def _handle_ready(self):
        if self.is_live():
            self.reactor.update_timer(self.timer, self.reactor.NOW)

    def read_model(self, stats):
        """degC from control_stats of the heater."""
        raise NotImplementedError

    def read_without_model(self, temperature):
        """degC, for a heater at that temperature (degC)."""
        raise NotImplementedError

    def _report(self, eventtime):
        if not self.heater.last_temp_time:
            return eventtime + self.report_time         # it has no reading yet
        status = self.heater.get_status(eventtime)
        stats = status.get("control_stats")
        temp = (self.read_without_model(status["temperature"]) if stats is None
                else self.read_model(stats))
        if not self._check(temp):
            return self.reactor.NEVER
        return self._deliver(eventtime, temp)

    def _check(self, temp):
        """False, and a shutdown, outside limits that count."""
        low, high = self.range
        was_outside, self.is_outside = self.is_outside, not low <= temp <= high
        if not self.is_outside:
            return True
        message = ("Sensor of '%s': the %s of the model of heater '%s' is %.1f degC,"
                   " outside its range %.1f..%.1f" % (
                       self.section, self.what, self.heater.short_name, temp, low,
                       high))
        if not self.is_free:
            self.printer.invoke_shutdown(message)
            return False
        if self.is_loud and not was_outside:
            self.printer.lookup_object("gcode").respond_info(message)
        return True


class MpcBlockTemperature(MpcTemperature):
    """Reads the block, which its sensor follows."""

    what = "block"

    def read_model(self, stats):
        return stats["temp_block"]

    def read_without_model(self, temperature):
        return temperature


class MpcAmbientTemperature(MpcTemperature):
    """Reads what the model takes for the air around the heater."""

    what = "surroundings"

    def read_model(self, stats):
        return stats["temp_ambient"]

    def read_without_model(self, temperature):
        return USUAL_ROOM
