# SPDX-License-Identifier: GPL-3.0-or-later
"""sensor_type temperature_combined: one temperature made of several sensors."""

REPORT_TIME = 0.300         # s
# All sensors have reported by then (s after ready)
START_DELAY = 3.0
ABSOLUTE_ZERO = -273.15
METHODS = {"min": min, "max": max, "mean": lambda values: sum(values) / len(values)}
OTHER_FIELDS = ("humidity", "pressure", "gas")


class PrinterSensorCombined:
    """A sensor; status: temperature in degC, and what all of its sensors have."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        self.section = config.get_name()
        self.sensor_names = config.getlist("sensor_list")
        self.max_deviation = config.getfloat("maximum_deviation", above=0.0)
        self.combine = config.getchoice("combination_method", METHODS)
        self.sensors = []
        self.temp, self.range = 0.0, (ABSOLUTE_ZERO, float("inf"))
        self.values = dict.fromkeys(OTHER_FIELDS)
        self.callback = None
        self.check_time = self.reactor.NEVER
        self.timer = self.reactor.register_timer(self._report)
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
            self.sensors.append(sensor)

    def _handle_ready(self):
        if self.printer.get_start_args().get("debugoutput") is not None:
            return
        now = self.reactor.monotonic()
        self.check_time = now + START_DELAY
        self.reactor.update_timer(self.timer, now + REPORT_TIME)

    def setup_minmax(self, min_temp, max_temp):
        """Shut down outside min_temp..max_temp (degC)."""
        self.range = (min_temp, max_temp)

    def setup_callback(self, callback):
        """Call callback(print_time, degC) at each report."""
        self.callback = callback

    def get_report_time_delta(self):
        """Seconds between two reports."""
        return REPORT_TIME

    def _report(self, eventtime):
        states = [sensor.get_status(eventtime) for sensor in self.sensors]
        temps = [state["temperature"] for state in states]
        if eventtime >= self.check_time and not self._check(temps):
            return self.reactor.NEVER
        self.temp = self.combine(temps)
        for field in OTHER_FIELDS:
            found = [state.get(field) for state in states]
            self.values[field] = None if None in found else self.combine(found)
        mcu = self.printer.lookup_object("mcu")
        self.callback(mcu.estimated_print_time(eventtime), self.temp)
        return eventtime + REPORT_TIME

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
