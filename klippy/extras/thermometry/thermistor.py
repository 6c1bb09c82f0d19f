# SPDX-License-Identifier: GPL-3.0-or-later
"""Thermistors: resistance curves, built-in types and [thermistor name].

A thermistor is the lower leg of a divider between the ADC's reference
and ground; pullup_resistor is the upper leg and inline_resistor sits in
series with the thermistor.  Curve: 1/T = a + b*ln(R) + c*ln(R)^3.
"""

import math

from klippy.extras import adc_temperature
from klippy.record import record

ZERO_CELSIUS = 273.15
OPEN_OR_SHORT = 1e-5

# (degC, ohm) triples, or one pair and the beta constant, from the
# manufacturers' data sheets.
BUILT_IN = {
    "ATC Semitec 104GT-2":
        ((20.0, 126800.0), (150.0, 1360.0), (300.0, 80.65)),
    "ATC Semitec 104NT-4-R025H42G":
        ((25.0, 100000.0), (160.0, 1074.0), (300.0, 82.78)),
    "EPCOS 100K B57560G104F":
        ((25.0, 100000.0), (150.0, 1641.9), (250.0, 226.15)),
    "Generic 3950":
        ((25.0, 100000.0), (150.0, 1770.0), (250.0, 230.0)),
    "SliceEngineering 450":
        ((25.0, 500000.0), (200.0, 3734.0), (400.0, 240.0)),
    "TDK NTCG104LH104JT1":
        ((25.0, 100000.0), (50.0, 31230.0), (125.0, 2066.0)),
    "Honeywell 100K 135-104LAG-J01": ((25.0, 100000.0), 3974.0),
    "NTC 100K MGB18-104F39050L32": ((25.0, 100000.0), 4100.0),
}


# Near absolute zero a resistance is beyond all numbers
MAX_LOG_R = 600.0


@record(frozen=True)
class Curve:
    """Coefficients of 1/T = a + b*ln(R) + c*ln(R)^3 (K, ohm)."""

    a: float
    b: float
    c: float = 0.0

    def temperature(self, resistance):
        """degC at a resistance in ohm."""
        log_r = math.log(resistance)
        inverse = self.a + log_r * (self.b + self.c * log_r * log_r)
        if inverse <= 0.0:
            return math.inf
        return 1.0 / inverse - ZERO_CELSIUS

    def resistance(self, temperature):
        """Ohm at a temperature in degC (Newton; the curve is monotone)."""
        rest = self.a - 1.0 / (temperature + ZERO_CELSIUS)
        log_r = -rest / self.b
        for _ in range(60):
            error = rest + log_r * (self.b + self.c * log_r * log_r)
            slope = self.b + 3.0 * self.c * log_r * log_r
            step = error / slope
            log_r -= step
            if abs(step) < 1e-13:
                break
        return math.exp(min(log_r, MAX_LOG_R))


def fit_beta(point, beta):
    """Curve through one (degC, ohm) point with a beta constant (K)."""
    temperature, resistance = point
    a = 1.0 / (temperature + ZERO_CELSIUS) - math.log(resistance) / beta
    return Curve(a, 1.0 / beta)


def fit_points(points):
    """Curve through three (degC, ohm) points.

    Falls back to a beta curve through the outer points when the three
    do not bend the way thermistors do (c would not be positive).
    """
    logs = [math.log(r) for _, r in points]
    inverses = [1.0 / (t + ZERO_CELSIUS) for t, _ in points]
    slope01 = (inverses[1] - inverses[0]) / (logs[1] - logs[0])
    slope02 = (inverses[2] - inverses[0]) / (logs[2] - logs[0])
    # The divided difference of ln^3 over three points is their sum.
    c = (slope02 - slope01) / ((logs[2] - logs[1]) * sum(logs))
    if c <= 0.0:
        return fit_beta(points[0], 1.0 / slope02)
    squares = logs[0] ** 2 + logs[0] * logs[1] + logs[1] ** 2
    b = slope01 - c * squares
    a = inverses[0] - b * logs[0] - c * logs[0] ** 3
    return Curve(a, b, c)


def fit(spec):
    """Curve of a BUILT_IN style description: 3 points, or point + beta."""
    if len(spec) == 2:
        return fit_beta(*spec)
    return fit_points(spec)


class Thermistor:
    """Conversion between an ADC fraction and degC through the divider."""

    def __init__(self, pullup, inline_resistor):
        self.pullup = pullup
        self.inline_resistor = inline_resistor
        self.curve = None

    def setup_coefficients(self, t1, r1, t2, r2, t3, r3, name=""):
        """Use three (degC, ohm) points."""
        self.curve = fit_points(((t1, r1), (t2, r2), (t3, r3)))

    def setup_coefficients_beta(self, t1, r1, beta):
        """Use one (degC, ohm) point and the beta constant."""
        self.curve = fit_beta((t1, r1), beta)

    def calc_temp(self, adc):
        """degC at an ADC fraction (0..1)."""
        adc = min(max(adc, OPEN_OR_SHORT), 1.0 - OPEN_OR_SHORT)
        resistance = self.pullup * adc / (1.0 - adc) - self.inline_resistor
        return self.curve.temperature(max(resistance, 1e-9))

    def calc_adc(self, temp):
        """ADC fraction (0..1) at a temperature in degC."""
        if temp <= -ZERO_CELSIUS:
            return 1.0
        lower_leg = self.curve.resistance(temp) + self.inline_resistor
        return lower_leg / (self.pullup + lower_leg)


def make_sensor(config, spec):
    """Sensor of a heater section wired to a thermistor of this kind."""
    pullup = config.getfloat("pullup_resistor", 4700.0, above=0.0)
    inline = config.getfloat("inline_resistor", 0.0, minval=0.0)
    thermistor = Thermistor(pullup, inline)
    thermistor.curve = fit(spec)
    return adc_temperature.PrinterADCtoTemperature(config, thermistor)


def PrinterThermistor(config, params):
    """Plug-in entry: params has t1, r1 and beta, or t1..t3 and r1..r3."""
    first = (params["t1"], params["r1"])
    if "beta" in params:
        return make_sensor(config, (first, params["beta"]))
    return make_sensor(config, (
        first, (params["t2"], params["r2"]), (params["t3"], params["r3"])))


class CustomThermistor:
    """A [thermistor name] section: a sensor_type of the user's own."""

    def __init__(self, config):
        self.name = " ".join(config.get_name().split()[1:])
        first = self._read_point(config, 1)
        beta = config.getfloat("beta", None, above=0.0)
        if beta is not None:
            self.spec = (first, beta)
            return
        self.spec = (first, self._read_point(config, 2),
                     self._read_point(config, 3))
        self._check_spread(config)

    def _read_point(self, config, index):
        temperature = config.getfloat(
            "temperature%d" % index, minval=-ZERO_CELSIUS)
        resistance = config.getfloat("resistance%d" % index, minval=0.0)
        if not resistance or temperature <= -ZERO_CELSIUS:
            raise config.error(
                "Section '%s': point %d needs a resistance above 0 ohm and a"
                " temperature above -273.15, not %.3f ohm at %.2f"
                % (config.get_name(), index, resistance, temperature))
        return (temperature, resistance)

    def _check_spread(self, config):
        temperatures = {t for t, _ in self.spec}
        resistances = {r for _, r in self.spec}
        if len(temperatures) != 3 or len(resistances) != 3:
            raise config.error(
                "Section '%s': the three temperatures and the three"
                " resistances must all differ" % (config.get_name(),))

    def create(self, config):
        """Sensor for the heater section `config`."""
        return make_sensor(config, self.spec)


def load_config(config):
    heaters = config.get_printer().load_object(config, "heaters")
    for name, spec in BUILT_IN.items():
        heaters.add_sensor_factory(
            name, lambda section, spec=spec: make_sensor(section, spec))


def load_config_prefix(config):
    custom = CustomThermistor(config)
    heaters = config.get_printer().load_object(config, "heaters")
    heaters.add_sensor_factory(custom.name, custom.create)
    return custom
