# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters are found in noisy records of a heater made by small Euler steps."""
import random

import pytest

from klippy.extras import mpc_fit

PERIOD = 0.3


class Plant:
    """An independent heater: block and sensor by steps of 5 ms."""

    def __init__(self, power, capacity, responsiveness, transfer, ambient, start):
        self.power, self.capacity = power, capacity
        self.responsiveness, self.transfer = responsiveness, transfer
        self.ambient, self.block, self.sensor = ambient, start, start
        self.rng = random.Random(7)
        self.record = []

    def run(self, seconds, duty, until=1e9):
        for _ in range(round(seconds / PERIOD)):
            for _ in range(60):
                heat = self.power * duty - self.transfer * (self.block - self.ambient)
                self.sensor += self.responsiveness * (self.block - self.sensor) * 0.005
                self.block += heat / self.capacity * 0.005
            self.record.append(
                (PERIOD, duty, self.sensor + self.rng.gauss(0.0, 0.1)))
            if self.sensor > until:
                break


@pytest.mark.parametrize("power,capacity,responsiveness,transfer,ambient,target", [
    (40.0, 10.0, 0.67, 0.065, 25.0, 200.0), (250.0, 700.0, 0.33, 1.5, 15.0, 90.0),
    (60.0, 5.0, 2.0, 0.05, 40.0, 240.0), (30.0, 25.0, 0.2, 0.1, 5.0, 200.0)])
def test_heaters_are_found(power, capacity, responsiveness, transfer, ambient, target):
    plant = Plant(power, capacity, responsiveness, transfer, ambient, ambient)
    plant.run(20.0, 0.0)
    plant.run(1000.0, 1.0, target)
    plant.run(0.3 * capacity / transfer,
              transfer * (target - ambient) / power)
    fit = mpc_fit.fit_heater(
        power, plant.record, mpc_fit.guess_heater(power, plant.record))
    assert fit.capacity == pytest.approx(capacity, rel=0.01)
    assert fit.responsiveness == pytest.approx(responsiveness, rel=0.05)
    assert fit.transfer == pytest.approx(transfer, rel=0.02)
    assert fit.ambient == pytest.approx(ambient, abs=1.0)
    assert fit.error == pytest.approx(0.1, rel=0.15)


def test_known_room_is_kept():
    plant = Plant(40.0, 10.0, 0.67, 0.065, 25.0, 25.0)
    plant.run(60.0, 1.0)
    guess = mpc_fit.guess_heater(40.0, plant.record)
    fit = mpc_fit.fit_heater(40.0, plant.record, guess, 25.0)
    assert fit.ambient == 25.0
    assert fit.transfer == pytest.approx(0.065, rel=0.05)


def test_something_else_than_a_heater_shows_as_error():
    """A sensor that jumps halfway through."""
    plant = Plant(40.0, 10.0, 0.67, 0.065, 25.0, 25.0)
    plant.run(50.0, 1.0)
    record = [(e, d, t + (40.0 if i > 80 else 0.0))
              for i, (e, d, t) in enumerate(plant.record)]
    fit = mpc_fit.fit_heater(40.0, record, mpc_fit.guess_heater(40.0, record))
    assert fit.error > 5.0


def test_no_climb_is_refused():
    plant = Plant(40.0, 10.0, 0.67, 0.065, 25.0, 25.0)
    plant.run(20.0, 0.0)
    with pytest.raises(ValueError, match="did not get warmer"):
        mpc_fit.guess_heater(40.0, plant.record)
