# SPDX-License-Identifier: GPL-3.0-or-later
"""Temperatures: heater blocks, their losses and the lag of their sensors.

A heater is one heat capacity that electric power warms and the room, the
part fan and filament cool; its sensor follows it with a first order lag.  Both
are integrated exactly for power and fan constant over a step, so the
result does not depend on the size of the steps.
"""
import math
from dataclasses import dataclass

from klippy.errors import ConfigError
from klippy.extras import adc_temperature, sensor_tables, temperature_mcu, thermistor

# Sensor readings are held inside this range of the reference voltage.
ADC_MARGIN = 1e-6


@dataclass(frozen=True)
class HeaterTraits:
    """Physics of a heater: W, J/K, W/K, W/K at full part fan, s."""

    power: float
    capacity: float
    loss: float
    fan_loss: float
    sensor_lag: float


# 40 W cartridge, about a minute to 210 degC; a 4 mm aluminium bed that
# takes two to 60 degC; anything else is something in between.
HOTEND = HeaterTraits(40.0, 10.0, 0.065, 0.03, 1.5)
BED = HeaterTraits(250.0, 700.0, 1.5, 0.0, 3.0)
OTHER = HeaterTraits(100.0, 100.0, 0.8, 0.0, 2.0)


def choose_traits(section_name, options):
    """HeaterTraits of a section with the overrides of SimOptions."""
    short = section_name.split()[-1]
    if section_name.startswith("extruder"):
        base = HOTEND
    elif section_name == "heater_bed":
        base = BED
    else:
        base = OTHER
    return HeaterTraits(
        options.heater_power.get(short, base.power),
        options.heat_capacity.get(short, base.capacity),
        options.heat_loss.get(short, base.loss),
        base.fan_loss, base.sensor_lag)


class HeaterModel:
    """Temperature (degC) of a heater and of its sensor."""

    def __init__(self, traits, ambient):
        self.traits = traits
        self.ambient = ambient
        self.temperature = ambient
        self.sensor_temperature = ambient

    def advance(self, elapsed, duty, fan=0.0, filament=0.0):
        """Go `elapsed` s ahead with the heater and part fan at 0..1.

        filament: W/K that cold filament takes meanwhile.
        """
        traits = self.traits
        loss = traits.loss + traits.fan_loss * fan + filament
        final = self.ambient + duty * traits.power / loss
        rate = loss / traits.capacity
        offset = self.temperature - final
        decay = math.exp(-rate * elapsed)
        self.temperature = final + offset * decay
        self._advance_sensor(elapsed, final, offset, rate, decay)

    def _advance_sensor(self, elapsed, final, offset, rate, decay):
        # d(sensor)/dt = (temperature - sensor) / lag, solved for the
        # exponential course of the temperature.
        lag_rate = 1.0 / self.traits.sensor_lag
        share = offset * lag_rate / (lag_rate - rate)
        own = self.sensor_temperature - final - share
        self.sensor_temperature = (
            final + share * decay + own * math.exp(-lag_rate * elapsed))


def make_converter(config, section):
    """Curve of a section's sensor: an object with calc_adc(degC).

    None for sensors that are not behind an analog pin.
    """
    kind = section.get("sensor_type")
    if kind == "temperature_mcu":
        return _make_chip_sensor(section)
    if kind is None or section.get("sensor_pin") is None:
        return None
    if kind in thermistor.BUILT_IN:
        return _make_thermistor(section, thermistor.BUILT_IN[kind])
    if config.has("thermistor " + kind):
        custom = thermistor.CustomThermistor(config.get("thermistor " + kind))
        return _make_thermistor(section, custom.spec)
    return _make_table_sensor(config, section, kind)


def _make_chip_sensor(section):
    """The sensor of the simulated board itself, at its usual reference."""
    line = temperature_mcu.Line()
    line.set_typical(temperature_mcu.FAMILIES["simulator"], 3.3)
    return line


def _make_thermistor(section, spec):
    sensor = thermistor.Thermistor(
        section.getfloat("pullup_resistor", 4700.0),
        section.getfloat("inline_resistor", 0.0))
    sensor.curve = thermistor.fit(spec)
    return sensor


def _make_table_sensor(config, section, kind):
    voltages = sensor_tables.voltage_tables()
    if kind in voltages:
        return adc_temperature.LinearVoltage(section, voltages[kind])
    resistances = sensor_tables.resistance_tables()
    if kind in resistances:
        return adc_temperature.LinearResistance(section, resistances[kind])
    if not config.has("adc_temperature " + kind):
        return None
    custom = adc_temperature.CustomSensor(
        config.get("adc_temperature " + kind))
    return custom.converter(section, custom.points)


def calc_fraction(converter, temperature):
    """Fraction of the reference voltage a sensor shows at degC."""
    fraction = converter.calc_adc(temperature)
    if not math.isfinite(fraction):
        raise ConfigError("Sensor has no reading at %.1f degC" % temperature)
    return min(max(fraction, ADC_MARGIN), 1.0 - ADC_MARGIN)
