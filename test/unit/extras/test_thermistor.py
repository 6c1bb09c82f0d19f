# SPDX-License-Identifier: GPL-3.0-or-later
"""Thermistor curves against their data-sheet points and against algebra."""
import math

import pytest

from klippy.extras import thermistor


@pytest.mark.parametrize("name", sorted(thermistor.BUILT_IN))
def test_curve_goes_through_its_points(name):
    spec = thermistor.BUILT_IN[name]
    points = spec[:1] if len(spec) == 2 else spec
    curve = thermistor.fit(spec)
    for temperature, resistance in points:
        assert curve.temperature(resistance) == pytest.approx(temperature)
        assert curve.resistance(temperature) == pytest.approx(resistance)


@pytest.mark.parametrize("name", sorted(thermistor.BUILT_IN))
def test_calc_adc_inverts_calc_temp(name):
    sensor = thermistor.Thermistor(4700.0, 10.0)
    sensor.curve = thermistor.fit(thermistor.BUILT_IN[name])
    fractions = []
    for temp in range(-30, 400, 7):
        fraction = sensor.calc_adc(temp)
        assert sensor.calc_temp(fraction) == pytest.approx(temp, abs=1e-6)
        fractions.append(fraction)
    assert fractions == sorted(fractions, reverse=True)


def test_beta_curve_is_the_textbook_formula():
    curve = thermistor.fit_beta((25.0, 100000.0), 3950.0)
    expected = 100000.0 * math.exp(3950.0 * (1 / 373.15 - 1 / 298.15))
    assert curve.resistance(100.0) == pytest.approx(expected)


def test_near_absolute_zero_it_is_open():
    curve = thermistor.fit_beta((25.0, 100000.0), 4000.0)
    assert 1e200 < curve.resistance(-273.0) < math.inf


def test_points_that_do_not_bend_fall_back_to_beta():
    exact = thermistor.fit_beta((25.0, 100000.0), 4000.0)
    points = [(t, exact.resistance(t)) for t in (25.0, 150.0, 250.0)]
    points[1] = (150.0, points[1][1] * 0.8)
    curve = thermistor.fit_points(points)
    assert curve.c == 0.0
    for temperature, resistance in (points[0], points[2]):
        assert curve.temperature(resistance) == pytest.approx(temperature)


@pytest.mark.parametrize("adc", [0.0, 1.0, -0.1, 1.1])
def test_open_and_short_give_a_reading(adc):
    sensor = thermistor.Thermistor(4700.0, 0.0)
    sensor.setup_coefficients_beta(25.0, 100000.0, 3950.0)
    temp = sensor.calc_temp(adc)
    assert temp < -30.0 if adc > 0.5 else temp > 500.0
