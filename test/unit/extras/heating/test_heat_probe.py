# SPDX-License-Identifier: GPL-3.0-or-later
"""HeatProbe against a block with a lagging, noisy sensor under a PI control."""
import random

import pytest

from klippy.extras import heat_probe

TARGET, PERIOD = 210.0, 0.3


class Loop:
    """A held hotend: 4 degC/s at full power, 0.0016 of it lost a degree."""

    def __init__(self, noise, step, seed=1, lag=1.5):
        self.rng = random.Random(seed)
        self.noise, self.step, self.lag = noise, step, lag
        self.block = self.sensor = TARGET
        self.integral = 0.0016 * (TARGET - 25.0)
        self.duty = self.integral
        self.is_stuck = False
        self.now = 0.0
        self.highest, self.lowest = 0.0, 999.0
        self.probe = heat_probe.HeatProbe(heat_probe.EXTRUDER)

    def run(self, seconds):
        """(s until a fault, or all of them; the fault)."""
        for i in range(int(seconds / PERIOD)):
            self.now += PERIOD
            loss = 0.0016 * (1.2 if self.now % 400 > 200 else 1.0)
            self.block += PERIOD * 4.0 * (self.duty - loss * (self.block - 25.0))
            self.sensor += PERIOD / self.lag * (self.block - self.sensor)
            shown = TARGET + 0.02 if self.is_stuck else self.sensor
            shown += self.rng.gauss(0.0, self.noise)
            shown = round(shown / self.step) * self.step
            self.lowest = min(self.lowest, self.block)
            self.highest = max(self.highest, self.block)
            code = self.probe.update(PERIOD, shown, TARGET, self.duty, 4.0)
            if code:
                return i * PERIOD, code
            error = TARGET - shown
            self.integral += 0.0005 * error * PERIOD
            self.duty = min(max(0.03 * error + self.integral, 0.0), 1.0)
            self.duty += self.probe.offset
        return seconds, heat_probe.NONE


QUIET, USUAL, LOUD = (0.0, 0.1), (0.05, 0.03), (0.25, 0.1)


@pytest.mark.parametrize("noise,step", [QUIET, USUAL, LOUD])
def test_live_sensor_is_known_and_left_alone(noise, step):
    loop = Loop(noise, step)
    assert loop.run(4 * 3600.0)[1] == heat_probe.NONE
    assert 0.1 < loop.probe.gain < 1.2


@pytest.mark.parametrize("noise,step,limit", [
    (*QUIET, 400.0), (*USUAL, 500.0), (*LOUD, 1500.0)])
def test_stuck_sensor_is_seen(noise, step, limit):
    loop = Loop(noise, step)
    loop.run(3600.0)
    loop.is_stuck = True
    seconds, code = loop.run(4000.0)
    assert code == heat_probe.DEAD and seconds < limit


def test_slow_sensor_is_seen():
    loop = Loop(*USUAL)
    loop.run(3600.0)
    loop.lag = 30.0
    assert loop.run(7200.0)[1] == heat_probe.DEAD


def test_waves_disturb_little():
    """The loss changes by 20 % every 200 s, which is 0.5 degC and more."""
    calm, probed = Loop(*USUAL), Loop(*USUAL)
    ranges = []
    for loop in (calm, probed):
        if loop is calm:
            loop.probe = type("None", (), {
                "offset": 0.0, "update": lambda self, *args: 0})()
        loop.run(1200.0)
        loop.highest, loop.lowest = 0.0, 999.0
        loop.run(3600.0)
        ranges.append(loop.highest - loop.lowest)
    assert ranges[1] - ranges[0] < 0.6


def test_no_waves_while_nothing_is_held():
    probe = heat_probe.HeatProbe(heat_probe.EXTRUDER)
    for i in range(3000):
        assert probe.update(PERIOD, 25.0 + 0.01 * (i % 7), 0.0, 0.0, 4.0) == 0
        assert probe.offset == 0.0
    for i in range(3000):
        assert probe.update(PERIOD, 100.0 + 0.01 * (i % 7), 210.0, 1.0, 4.0) == 0
        assert probe.offset == 0.0
