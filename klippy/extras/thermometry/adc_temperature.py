# SPDX-License-Identifier: GPL-3.0-or-later
"""Temperature sensors behind an analog pin, and [adc_temperature name]."""
import bisect
from itertools import pairwise

from klippy.extras import query_adc, sensor_tables

SAMPLE_TIME = 0.001
SAMPLE_COUNT = 8
REPORT_TIME = 0.300
RANGE_CHECK_COUNT = 4
MAX_POINTS = 999
# So near (share of full scale) to either end no sensor reads
END_OF_SCALE = 0.002


class PrinterADCtoTemperature:
    """A sensor: an ADC pin plus a converter with calc_temp and calc_adc.

    Reports (print_time, degC) every REPORT_TIME seconds.  The mcu itself
    shuts down after RANGE_CHECK_COUNT readings outside min/max.
    """

    def __init__(self, config, adc_convert, pin=None):
        """pin: instead of the option sensor_pin."""
        self.adc_convert = adc_convert
        self.name = config.get_name()
        self.temperature_callback = None
        self.range = None
        ppins = config.get_printer().lookup_object("pins")
        self.pin = config.get("sensor_pin") if pin is None else pin
        self.mcu_adc = ppins.setup_pin("adc", self.pin)
        self.mcu_adc.setup_adc_callback(self._handle_samples)
        self.mcu_adc.setup_adc_sample(REPORT_TIME, SAMPLE_TIME, SAMPLE_COUNT)
        query_adc.register(config, self.name, self.mcu_adc)
        config.get_printer().load_object(config, "error_mcu").add_clarify(
            "ADC out of range", self._explain_shutdown)

    def setup_callback(self, temperature_callback):
        """Call temperature_callback(print_time, degC) at each report."""
        self.temperature_callback = temperature_callback

    def get_report_time_delta(self):
        """Seconds between two reports."""
        return REPORT_TIME

    def setup_minmax(self, min_temp, max_temp):
        """Let the mcu shut down outside min_temp..max_temp (degC)."""
        self.range = (min_temp, max_temp)
        self.apply_range()

    def apply_range(self):
        """Tell the pin the readings at both ends of the range."""
        limits = sorted(min(max(self.adc_convert.calc_adc(t), 0.0), 1.0)
                        for t in self.range)
        self.mcu_adc.setup_adc_sample(
            REPORT_TIME, SAMPLE_TIME, SAMPLE_COUNT,
            minval=limits[0], maxval=limits[1],
            range_check_count=RANGE_CHECK_COUNT)

    def _handle_samples(self, samples):
        read_time, fraction = samples[-1]
        temperature = self.adc_convert.calc_temp(fraction)
        self.temperature_callback(read_time + SAMPLE_COUNT * SAMPLE_TIME,
                                  temperature)

    def _explain_shutdown(self, message, details):
        """Text for the user if it was this sensor that went out of range."""
        if (self.range is None
                or details.get("mcu") != self.mcu_adc.get_mcu().get_name()):
            return None
        last_time, fraction = self._last_sample()
        temperature = self.adc_convert.calc_temp(fraction)
        low, high = self.range
        if not last_time or low <= temperature <= high:
            return None
        return ("Sensor of '%s' (pin %s of mcu '%s') reads %s, outside its range"
                " %.1f..%.1f: check its wiring, sensor_type, min_temp and max_temp"
                % (self.name, self.pin, details["mcu"],
                   describe_reading(fraction, temperature), low, high))

    def _last_sample(self):
        value, sample_time = self.mcu_adc.get_last_value()
        return sample_time, value


def describe_reading(fraction, temperature):
    """Text for what an analog pin (0..1) and its sensor show."""
    if fraction < END_OF_SCALE:
        return "nothing (0 V, like a short to ground)"
    if fraction > 1.0 - END_OF_SCALE:
        return "nothing (full scale, like a short to the supply or an open contact)"
    return "%.1f degC" % (temperature,)


class LinearInterpolate:
    """Piecewise linear map through (key, value) samples, and its inverse.

    Beyond the ends the last segment goes on.
    """

    def __init__(self, samples):
        points = sorted(samples)
        self.keys = [key for key, _ in points]
        self.values = [value for _, value in points]
        steps = pairwise(self.keys)
        if len(points) < 2 or any(b <= a for a, b in steps):
            raise ValueError("need two or more points with distinct keys")
        rising = self.values[-1] > self.values[0]
        pairs = pairwise(self.values)
        if any((b > a) != rising or a == b for a, b in pairs):
            raise ValueError("values must rise, or fall, all the way")

    def interpolate(self, key):
        """Value at a key."""
        return _on_segment(self.keys, self.values, key)

    def reverse_interpolate(self, value):
        """Key at a value."""
        if self.values[-1] > self.values[0]:
            return _on_segment(self.values, self.keys, value)
        return _on_segment(self.values[::-1], self.keys[::-1], value)


def _on_segment(xs, ys, x):
    i = min(max(bisect.bisect_right(xs, x), 1), len(xs) - 1)
    slope = (ys[i] - ys[i - 1]) / (xs[i] - xs[i - 1])
    return ys[i - 1] + (x - xs[i - 1]) * slope


class LinearVoltage:
    """ADC fraction <-> degC for a sensor with a voltage table."""

    def __init__(self, config, params):
        self.reference = config.getfloat("adc_voltage", 5.0, above=0.0)
        self.offset = config.getfloat("voltage_offset", 0.0)
        self.curve = _make_curve(
            config, [(volt, temp) for temp, volt in params])

    def calc_temp(self, adc):
        """degC at an ADC fraction (0..1)."""
        return self.curve.interpolate(adc * self.reference - self.offset)

    def calc_adc(self, temp):
        """ADC fraction at a temperature in degC."""
        volts = self.curve.reverse_interpolate(temp)
        return (volts + self.offset) / self.reference


class LinearResistance:
    """ADC fraction <-> degC for a resistor below a pull-up.

    inline_resistor is in series with it, below the pull-up too.
    """

    def __init__(self, config, samples):
        self.pullup = config.getfloat("pullup_resistor", 4700.0, above=0.0)
        self.inline = config.getfloat("inline_resistor", 0.0, minval=0.0)
        self.curve = _make_curve(
            config, [(ohm, temp) for temp, ohm in samples])

    def calc_temp(self, adc):
        """degC at an ADC fraction (0..1)."""
        adc = min(max(adc, 1e-5), 1.0 - 1e-5)
        ohm = self.pullup * adc / (1.0 - adc) - self.inline
        return self.curve.interpolate(ohm)

    def calc_adc(self, temp):
        """ADC fraction at a temperature in degC."""
        ohm = max(self.curve.reverse_interpolate(temp), 0.0) + self.inline
        return ohm / (self.pullup + ohm)


def _make_curve(config, samples):
    try:
        return LinearInterpolate(samples)
    except ValueError as e:
        raise config.error("Sensor curve used by section '%s': %s"
                           % (config.get_name(), e)) from e


class CustomSensor:
    """An [adc_temperature name] section: a table of the user's own."""

    def __init__(self, config):
        self.name = " ".join(config.get_name().split()[1:])
        is_resistor = config.get("resistance1", None) is not None
        self.converter = LinearResistance if is_resistor else LinearVoltage
        self.points = []
        unit = "resistance" if is_resistor else "voltage"
        for i in range(1, MAX_POINTS + 1):
            temp = config.getfloat("temperature%d" % i, None)
            if temp is None:
                break
            self.points.append((temp, config.getfloat("%s%d" % (unit, i))))
        _make_curve(config, [(x, t) for t, x in self.points])

    def create(self, config):
        """Sensor for the heater section `config`."""
        return PrinterADCtoTemperature(
            config, self.converter(config, self.points))


def _make_voltage_sensor(config, table):
    return PrinterADCtoTemperature(config, LinearVoltage(config, table))


def _make_resistance_sensor(config, table):
    return PrinterADCtoTemperature(config, LinearResistance(config, table))


def load_config(config):
    heaters = config.get_printer().load_object(config, "heaters")
    for name, table in sensor_tables.voltage_tables().items():
        heaters.add_sensor_factory(
            name, lambda c, t=table: _make_voltage_sensor(c, t))
    for name, table in sensor_tables.resistance_tables().items():
        heaters.add_sensor_factory(
            name, lambda c, t=table: _make_resistance_sensor(c, t))


def load_config_prefix(config):
    custom = CustomSensor(config)
    heaters = config.get_printer().load_object(config, "heaters")
    heaters.add_sensor_factory(custom.name, custom.create)
    return custom
