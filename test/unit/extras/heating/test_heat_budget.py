# SPDX-License-Identifier: GPL-3.0-or-later
"""HeatBudget on a spread of heaters of one mass, integrated here."""
import math

import pytest

from klippy.extras import heat_budget

ROOM, STEP = 25.0, 0.3
# W, J/K, W/K, max_temp, what it stands at, its traits: from a small hotend in
# still air to a large one that is strong, beds of glass and of silicone, chambers
HEATERS = {
    "hotend 20 W": (20.0, 8.0, 0.04, 300.0, 210.0, heat_budget.EXTRUDER),
    "hotend 40 W": (40.0, 10.0, 0.065, 300.0, 240.0, heat_budget.EXTRUDER),
    "hotend 80 W": (80.0, 5.5, 0.05, 300.0, 270.0, heat_budget.EXTRUDER),
    "bed 60 W": (60.0, 200.0, 0.5, 120.0, 60.0, heat_budget.BED),
    "bed 250 W": (250.0, 700.0, 1.5, 130.0, 100.0, heat_budget.BED),
    "bed 1000 W": (1000.0, 3000.0, 5.0, 130.0, 110.0, heat_budget.BED),
    "chamber 400 W": (400.0, 4000.0, 5.0, 90.0, 60.0, heat_budget.OTHER)}


class Heater:
    """A heater that holds `temp`, and what it tells its HeatBudget."""

    def __init__(self, name):
        self.power, self.capacity, self.loss, self.max_temp, self.temp, traits = \
            HEATERS[name]
        self.budget = heat_budget.HeatBudget(traits, self.max_temp)
        self.patience = traits.patience
        self.seen = self.hottest = self.temp
        self.lag = 2.0
        self.is_stuck = False

    def find_need(self):
        """Duty that holds the temperature."""
        return self.loss * (self.temp - ROOM) / self.power

    def run(self, seconds, duty, losses=1.0):
        """(s until the fault, code) with a duty of the control."""
        for i in range(round(seconds / STEP)):
            given = 0.0 if self.budget.is_cut else min(duty, 1.0)
            lost = losses * self.loss * (self.temp - ROOM)
            self.temp += (given * self.power - lost) / self.capacity * STEP
            self.hottest = max(self.hottest, self.temp)
            if not self.is_stuck:
                self.seen += (self.temp - self.seen) * STEP / self.lag
            code = self.budget.update(
                STEP, self.seen, self.seen, given, self.power / self.capacity,
                self.loss / self.power, ROOM, 0.0)
            if code:
                return i * STEP, code
        return seconds, heat_budget.NONE


@pytest.fixture(params=HEATERS)
def heater(request):
    return Heater(request.param)


@pytest.mark.parametrize("excess", [1e9, 60.0])
def test_block_behind_a_stuck_sensor_is_bounded(heater, excess):
    """At full power, or at one that would make it too hot by 60 degC in the end."""
    heater.run(60.0, heater.find_need())
    heater.is_stuck = True
    duty = heater.loss * (heater.max_temp + excess - ROOM) / heater.power
    seconds, code = heater.run(12.0 * 3600.0, min(duty, 1.0))
    assert code == heat_budget.DEAD
    assert heater.hottest < heater.max_temp + 5.0


def test_steady_need_never_cuts(heater):
    assert heater.run(24 * 3600.0, heater.find_need()) == (24 * 3600.0, 0)
    assert heater.budget.n_cuts == 0


def test_live_sensor_under_high_losses_is_only_interrupted(heater):
    """As of a strong draft that looks like a sensor that reads far too low."""
    start = heater.temp
    losses = 1.5
    duty = losses * heater.find_need()
    seconds, code = heater.run(4.0 * 3600.0, duty, losses)
    assert code == heat_budget.NONE
    looks_like = ROOM + duty * heater.power / heater.loss
    if looks_like > heater.max_temp:
        assert heater.budget.n_cuts > 0
    # a dip of some degrees, not a cold heater
    assert heater.temp > start - 40.0


def test_slow_sensor_is_bounded(heater):
    """It is behind by as much as the heater may still rise, and more."""
    heater.lag = 0.7 * (heater.max_temp - ROOM) / (heater.power / heater.capacity)
    heater.temp = heater.seen = ROOM
    for _ in range(4000):
        heater.run(STEP, 1.0 if heater.seen < heater.max_temp - 20.0 else 0.0)
    assert heater.hottest < heater.max_temp + 5.0
    can_exceed = heater.loss * (heater.max_temp - ROOM) < 0.8 * heater.power
    assert heater.budget.n_cuts > 0 or not can_exceed


def test_reading_that_falls_by_itself_proves_nothing():
    """A sensor that has come off cools down, with power or without."""
    heater = Heater("hotend 40 W")
    heater.run(60.0, heater.find_need())
    heater.is_stuck = True
    time = 0.0
    while not heater.budget.is_cut:
        time += STEP
        heater.seen = 65.0 + 175.0 * math.exp(-time / 30.0)
        assert heater.run(STEP, 1.0)[1] == heat_budget.NONE and time < 60.0
    codes = set()
    for _ in range(round(heater.patience / STEP) + 2):
        time += STEP
        heater.seen = 65.0 + 175.0 * math.exp(-time / 30.0)
        codes.add(heater.run(STEP, 1.0)[1])
    assert heat_budget.DEAD in codes
    assert heater.hottest < heater.max_temp + 5.0


def test_without_a_rate_nothing_is_cut():
    budget = heat_budget.HeatBudget(heat_budget.BED, 130.0)
    for _ in range(10000):
        assert budget.update(STEP, 60.0, 60.0, 1.0, 0.0, 0.0, ROOM, 0.0) == 0
    assert budget.hot == 60.0 and not budget.is_cut


def test_losses_from_two_slopes_of_a_climb():
    assert heat_budget.calc_hold(4.0, 3.0, 100.0) == pytest.approx(0.0025)
    assert heat_budget.calc_hold(0.0, 0.0, 100.0) == 0.0
    assert heat_budget.calc_hold(4.0, -1.0, 100.0) == pytest.approx(0.009)
    assert heat_budget.calc_hold(4.0, 5.0, 100.0) == 0.0


def test_ceiling_holds_whatever_the_reading_says():
    """A reading that drifts: it falls without power, so the cut ends each time."""
    budget = heat_budget.HeatBudget(heat_budget.EXTRUDER, 300.0)
    block, duty, hottest = 210.0, 0.3, 0.0
    for i in range(6000):
        block += 0.3 * (4.0 * duty - (block - 25.0) / 150.0)
        hottest = max(hottest, block)
        temp = min(block, 210.0)
        budget.watch_ceiling(0.3, temp, 210.0, duty, 4.0, 1 / 600.0, 25.0, 0.0)
        # its control wants more and more
        duty = 0.0 if budget.is_under else min(0.3 + i * 1e-3, 1.0)
    assert budget.is_under or duty > 0.0
    assert 290.0 < hottest < 305.0


def test_lack_under_the_ceiling_is_a_fault():
    budget = heat_budget.HeatBudget(heat_budget.EXTRUDER, 300.0)
    codes = {budget.watch_ceiling(0.3, 180.0, 210.0, 0.6, 4.0, 1 / 600.0, 25.0, 0.0)
             for _ in range(3000)}
    assert codes == {heat_budget.NONE, heat_budget.TOO_COLD}


def test_sign_of_life_ends_doubt():
    budget = heat_budget.HeatBudget(heat_budget.EXTRUDER, 300.0)
    for _ in range(100):
        budget.update(0.3, 210.0, 210.0, 0.6, 4.0, 1 / 600.0, 25.0, 0.0)
    assert budget.hot > 230.0
    budget.trust(210.0)
    assert budget.hot == 210.0
