# SPDX-License-Identifier: GPL-3.0-or-later
"""[temperature_sensor name]: a sensor that drives nothing."""

from klippy import dangers
from klippy.mcu import absence

# The printer goes on without it
MAY_LACK_FIRMWARE = True

ABSOLUTE_ZERO = -273.15


class PrinterSensorGeneric:
    """Holds the last, lowest and highest reading of one sensor.

    Status: temperature (None while the sensor's part of the mcu is absent),
    measured_min_temp, measured_max_temp (degC).
    """

    def __init__(self, config):
        self.printer = config.get_printer()
        self.name = config.get_name().split()[-1]
        heaters = self.printer.load_object(config, "heaters")
        self.sensor = heaters.setup_sensor(config)
        self.min_temp = config.getfloat("min_temp", ABSOLUTE_ZERO,
                                        minval=ABSOLUTE_ZERO)
        self.max_temp = config.getfloat("max_temp", 99999999.9,
                                        above=self.min_temp)
        if not dangers.get(self.printer).temp_ignore_limits:
            self.sensor.setup_minmax(self.min_temp, self.max_temp)
        self.sensor.setup_callback(self.note_temperature)
        self.last_temp = 0.0
        self.measured = None
        self.part = absence.find_sensor_part(self.sensor)
        if self.part is not None:
            absence.watch(absence.find_mcu(self.sensor), self._handle_loss, None)
        heaters.register_sensor(config, self)

    def note_temperature(self, read_time, temp):
        """Take a reading in degC; called by the sensor."""
        self.last_temp = temp
        if not temp:
            return
        low, high = self.measured or (temp, temp)
        self.measured = (min(low, temp), max(high, temp))

    def _handle_loss(self):
        self.last_temp = 0.0

    def get_temp(self, eventtime):
        """(last reading in degC, 0.0: it has no target)."""
        return self.last_temp, 0.0

    def stats(self, eventtime):
        return False, "%s: temp=%.1f" % (self.name, self.last_temp)

    def get_status(self, eventtime):
        low, high = self.measured or (99999999.0, 0.0)
        is_absent = self.part is not None and absence.is_absent(self.part)
        return {"temperature": None if is_absent else round(self.last_temp, 2),
                "measured_min_temp": round(low, 2),
                "measured_max_temp": round(high, 2)}


def load_config_prefix(config):
    return PrinterSensorGeneric(config)
