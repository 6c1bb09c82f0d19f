# SPDX-License-Identifier: GPL-3.0-or-later
"""The heater model against Runge-Kutta integration of its equations."""
import math

import pytest

from klippy.extras import thermal_model
from klippy.extras.thermal_model import ThermalModel

AMBIENT = 22.0
# power, capacity, responsiveness, transfer of a hotend, a bed, and a heater
# whose sensor is as slow as its block
HEATERS = [(40.0, 10.0, 0.7, 0.065), (250.0, 700.0, 0.3, 1.5), (40.0, 10.0, 0.5, 5.0)]
# s, duty, fan W/K, filament W/K, filament degC
PLAN = [(7.0, 1.0, 0.0, 0.0, 0.0), (3.0, 0.2, 0.05, 0.0, 0.0),
        (5.0, 0.6, 0.02, 0.04, 25.0), (4.0, 0.0, 0.0, 0.0, 0.0)]


def integrate(heater, states, phase, n=4000):
    """Classical Runge-Kutta of block and sensor over one phase."""
    power, capacity, responsiveness, transfer = heater
    elapsed, duty, fan, filament, filament_temp = phase

    def slope(block, sensor):
        heat = (power * duty - (transfer + fan) * (block - AMBIENT)
                - filament * (block - filament_temp))
        return heat / capacity, responsiveness * (block - sensor)
    b, s = states
    dt = elapsed / n
    for _ in range(n):
        b1, s1 = slope(b, s)
        b2, s2 = slope(b + b1 * dt / 2, s + s1 * dt / 2)
        b3, s3 = slope(b + b2 * dt / 2, s + s2 * dt / 2)
        b4, s4 = slope(b + b3 * dt, s + s3 * dt)
        b += (b1 + 2 * b2 + 2 * b3 + b4) * dt / 6
        s += (s1 + 2 * s2 + 2 * s3 + s4) * dt / 6
    return b, s


@pytest.mark.parametrize("heater", HEATERS)
@pytest.mark.parametrize("n_steps", [1, 37])
def test_solves_its_equations(heater, n_steps):
    model = ThermalModel(*heater)
    model.reset(AMBIENT, AMBIENT)
    states = (AMBIENT, AMBIENT)
    for phase in PLAN:
        model.set_losses(*phase[2:])
        for _ in range(n_steps):
            model.predict(phase[0] / n_steps, phase[1])
        states = integrate(heater, states, phase)
        assert (model.block, model.sensor) == pytest.approx(states, abs=1e-5)


def test_without_losses_heat_adds_up():
    model = ThermalModel(40.0, 10.0, 0.5, 0.0)
    model.reset(20.0, 20.0)
    model.predict(30.0, 0.5)
    assert model.block == pytest.approx(20.0 + 30.0 * 0.5 * 40.0 / 10.0)
    states = integrate((40.0, 10.0, 0.5, 0.0), (20.0, 20.0), (30.0, 0.5, 0, 0, 0))
    assert model.sensor == pytest.approx(states[1], abs=1e-5)


def test_losses_balance_power_in_the_end():
    model = ThermalModel(40.0, 10.0, 0.5, 0.065)
    model.reset(AMBIENT, AMBIENT)
    model.set_losses(0.03, 0.02, 30.0)
    model.predict(1e5, 0.5)
    assert model.calc_loss(model.block) + model.calc_filament_loss(
        model.block) == pytest.approx(20.0)
    assert model.sensor == pytest.approx(model.block)


def test_equal_rates_stay_finite():
    model = ThermalModel(40.0, 10.0, 0.01, 0.1)
    model.reset(AMBIENT, AMBIENT)
    model.predict(100.0, 1.0)
    # x = rate * t = 1: block 1 - exp(-x), sensor 1 - (1 + x) exp(-x), times P/h
    assert model.block == pytest.approx(AMBIENT + 400.0 * (1 - math.exp(-1)))
    assert model.sensor == pytest.approx(AMBIENT + 400.0 * (1 - 2 * math.exp(-1)),
                                         rel=1e-5)


def test_correction_shifts_the_states():
    model = ThermalModel(*HEATERS[0])
    model.reset(100.0, 20.0)
    model.correct(1.0, 2.0, -3.0)
    assert (model.sensor, model.block, model.ambient) == (101.0, 102.0, 17.0)


@pytest.mark.parametrize("bad", [(0, 1, 1, 1), (1, 0, 1, 1), (1, 1, 0, 1),
                                 (1, 1, 1, -0.1), (math.nan, 1, 1, 1)])
def test_parameters_of_no_heater_are_refused(bad):
    with pytest.raises(ValueError, match="above 0"):
        ThermalModel(*bad)


def test_filament_carries_heat_away():
    # 1.75 mm of PLA at 10 mm/s: 24 mm^3/s, 29 mg/s, 52 mW/K
    transfer = thermal_model.calc_filament_transfer(10.0, 1.75, 1.2, 1.8)
    assert transfer == pytest.approx(0.05195, rel=1e-3)
    assert thermal_model.calc_filament_transfer(-5.0, 1.75, 1.2, 1.8) == 0.0


def test_fan_table_is_interpolated():
    table = (0.0, 0.02, 0.03)
    for speed, transfer in ((0.0, 0.0), (0.25, 0.01), (0.5, 0.02), (0.75, 0.025),
                            (1.0, 0.03), (2.0, 0.03), (-1.0, 0.0)):
        assert thermal_model.interpolate_transfer(table, speed) == pytest.approx(
            transfer)
    assert thermal_model.interpolate_transfer((), 0.7) == 0.0
    assert thermal_model.interpolate_transfer((0.04,), 0.7) == pytest.approx(0.04)
