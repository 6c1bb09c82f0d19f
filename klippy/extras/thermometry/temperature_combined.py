# SPDX-License-Identifier: GPL-3.0-or-later
"""sensor_type temperature_combined: one temperature made of several sensors."""

from klippy.extras.polled_sensor import PolledSensor

# All sensors have reported by then (s after ready)
START_DELAY = 3.0
METHODS = {"min": min, "max": max, "mean": lambda values: sum(values) / len(values)}
OTHER_FIELDS = ("humidity", "pressure", "gas")


class PrinterSensorCombined(PolledSensor):
    """A sensor; status: temperature in degC, and what all of its sensors have."""

    def __init__(self, config):
        super().__init__(config)
        printer = self.printer
        self.sensor_names = config.getlist("sensor_list")
        self.max_deviation = config.getfloat("maximum_deviation", above=0.0)
        self.combine = config.getchoice("combination_method", METHODS)
        self.sensors = []
        self.temp = 0.0
        self.values = dict.fromkeys(OTHER_FIELDS)
        self.check_time = self.reactor.NEVER
        printer.add_object(
            "temperature_combined " + self.section.split()[-1], self)
        printer.register_event_handler("klippy:connect", self._handle_connect)
        printer.register_event_handler("klippy:ready", self._handle_ready)

    def _handle_connect(self):
        for name in self.sensor_names:
            sensor = self.printer.lookup_object(name, None)
            status = {}
            if hasattr(sensor, "get_status"):
                status = sensor.get_status(self.reactor.monotonic())
            if "temperature" not in status:
                raise self.printer.config_error(
                    "Option 'sensor_list' in section '%s': '%s' is no section with a"
                    " temperature" % (self.section, name))
            lack = getattr(getattr(sensor, "part", None), "lack", None)
            if lack is not None:
                raise self.printer.config_error(
                    "Option 'sensor_list' in section '%s' has a sensor that cannot be"
                    " read: %s" % (self.section, lack))
            self.sensors.append(sensor)

    def _handle_ready(self):
        if not self.is_live():
            return
        now = self.reactor.monotonic()
        self.check_time = now + START_DELAY
        self.reactor.update_timer(self.timer, now + self.report_time)

    def _report(self, eventtime):
        states = [sensor.get_status(eventtime) for sensor in self.sensors]
        temps = [state["temperature"] for state in states]
        if eventtime >= self.check_time and not self._check(temps):
            return self.reactor.NEVER
        self.temp = self.combine(temps)
        for field in OTHER_FIELDS:
            found = [state.get(field) for state in states]
            self.values[field] = None if None in found else self.combine(found)
        return self._deliver(eventtime, self.temp)

    def _check(self, temps):
        """False, and a shutdown, if the readings cannot be trusted."""
        listed = ", ".join("%s %.1f" % pair for pair in
                           zip(self.sensor_names, temps, strict=True))
        if max(temps) - min(temps) > self.max_deviation:
            self.printer.invoke_shutdown(
                "Sensors of '%s' (temperature_combined) differ by more than %.1f degC:"
                " %s" % (self.section, self.max_deviation, listed))
            return False
        temp = self.combine(temps)
        low, high = self.range
        if not low <= temp <= high:
            self.printer.invoke_shutdown(
                "Sensor of '%s' (temperature_combined) reads %.1f degC, outside its"
                " range %.1f..%.1f: %s" % (self.section, temp, low, high, listed))
            return False
        return True

    def get_status(self, eventtime):
        return {"temperature": round(self.temp, 2), **self.values}


def load_config(config):
    config.get_printer().load_object(config, "heaters").add_sensor_factory(
        "temperature_combined", PrinterSensorCombined)
