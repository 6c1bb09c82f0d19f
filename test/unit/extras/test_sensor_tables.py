# SPDX-License-Identifier: GPL-3.0-or-later
"""Sensor curves against published table values."""
import pytest

from klippy.extras import adc_temperature, sensor_tables


@pytest.mark.parametrize("kind,temperature,millivolts", [
    ("K", 0, 0.0), ("K", 25, 1.000), ("K", 100, 4.096), ("K", 500, 20.644),
    ("K", 1000, 41.276), ("K", -100, -3.554), ("J", 25, 1.277),
    ("J", 100, 5.269), ("J", 500, 27.393), ("J", -100, -4.633)])
def test_thermocouple_follows_its90(kind, temperature, millivolts):
    value = sensor_tables.calc_thermocouple_mv(kind, temperature)
    assert value == pytest.approx(millivolts, abs=0.0006)


@pytest.mark.parametrize("temperature,ohm", [
    (-50, 80.31), (0, 100.0), (100, 138.51), (200, 175.86), (400, 247.09)])
def test_platinum_follows_iec60751(temperature, ohm):
    value = sensor_tables.calc_platinum_resistance(temperature, 100.0)
    assert value == pytest.approx(ohm, abs=0.006)


@pytest.mark.parametrize("name,temperature,volts", [
    ("AD595", 25, 0.250), ("AD595", 100, 1.015), ("AD8495", 25, 0.125),
    ("AD8495", 100, 0.504), ("AD8494", 25, 0.125), ("AD8496", 60, 0.300),
    ("AD8497", 60, 0.300), ("PT100 INA826", 0, 1.11),
    ("PT100 INA826", 200, 1.92)])
def test_amplifier_output(name, temperature, volts):
    table = sensor_tables.voltage_tables()[name]
    curve = adc_temperature.LinearInterpolate([(v, t) for t, v in table])
    assert curve.reverse_interpolate(temperature) == pytest.approx(
        volts, abs=0.006)


def test_every_table_is_monotone_and_inverts():
    tables = {**sensor_tables.voltage_tables(),
              **sensor_tables.resistance_tables()}
    for table in tables.values():
        curve = adc_temperature.LinearInterpolate([(x, t) for t, x in table])
        for temp in (5.0, 37.3, 249.9):
            x = curve.reverse_interpolate(temp)
            assert curve.interpolate(x) == pytest.approx(temp)


@pytest.mark.parametrize("samples", [
    [(1.0, 20.0)], [(1.0, 20.0), (1.0, 30.0)],
    [(1.0, 20.0), (2.0, 30.0), (3.0, 25.0)]])
def test_unusable_tables_are_refused(samples):
    with pytest.raises(ValueError):
        adc_temperature.LinearInterpolate(samples)
