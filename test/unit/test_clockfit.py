# SPDX-License-Identifier: GPL-3.0-or-later
import itertools
import math
import os
import random

import pytest

from klippy.clockfit import MAX_INTERVAL, MIN_INTERVAL, ClockFit, GridMean

FREQ = 20e6
BOOT = 90.
TO, BACK = 0.0004, 0.0006
ASIDE = (TO - BACK) / 2.    # nobody can know how the least round trip divides
DRIFT = 1e-6 / 60.          # 1 ppm a minute
LIMIT = 20e-6
WARM_UP = 120.
IS_PURE = bool(os.environ.get("KLIPPY_PURE"))


class Clock:
    """A clock, and how its answers come: delay(rng, time) -> s beyond the least."""

    def __init__(self, ppm=0., drift=0., to=0., back=0., seed=1, start=100.):
        self.gain, self.drift = ppm * 1e-6, drift
        self.to, self.back = to, back
        self.rng = random.Random(seed)
        self.now = self.start = start
        self.fit, self.n_samples = None, 0

    def true_clock(self, time):
        elapsed = time - self.start
        return FREQ * (time - BOOT + self.gain * elapsed
                       + 0.5 * self.drift * elapsed * elapsed)

    def sample(self, late=0.):
        """Ask once, and let time pass until the next question."""
        to = TO + self.to * self.rng.random()
        back = BACK + self.back * self.rng.random() + late
        clock = int(self.true_clock(self.now + to))
        if self.fit is None:
            self.fit = ClockFit(FREQ, self.now, clock)
        self.fit.add(self.now, self.now + to + back, clock)
        self.n_samples += 1
        self.now += 0.05 if self.n_samples < 9 else self.fit.get_interval()

    def run(self, seconds, lead=2.):
        """Errors (s) of the line, `lead` s ahead, about once a second."""
        errors, end, next_time = [], self.now + seconds, self.now
        while self.now < end:
            self.sample()
            if self.now >= next_time:
                next_time = self.now + 1.
                clock, freq = self.fit.line_at(self.now)
                truth = self.true_clock(self.now + lead)
                errors.append((clock + freq * lead - truth) / FREQ - ASIDE)
        return errors


def calc_pair_errors(jitter_to, jitter_from, drift, seconds=240.):
    """How far two boards, 400 ppm apart, are beside each other after the warm-up."""
    runs = []
    for seed, sign in ((1, 1.), (2, -1.)):
        clock = Clock(200. * sign, drift * sign, jitter_to, jitter_from, seed)
        clock.run(WARM_UP)
        runs.append(clock.run(seconds))
    return [abs(a - b) for a, b in zip(*runs, strict=False)]


@pytest.mark.parametrize("drift", [0., DRIFT])
@pytest.mark.parametrize("jitter", [0.0001, 0.001, 0.003, 0.01])
@pytest.mark.parametrize("to,back", [(1, 1), (1, 0), (0, 1)])
def test_two_boards_agree(jitter, to, back, drift):
    if IS_PURE and jitter > 0.001:
        pytest.skip("tens of thousands of samples take too long uncompiled")
    errors = sorted(calc_pair_errors(jitter * to, jitter * back, drift))
    assert errors[int(len(errors) * 0.999)] < LIMIT


@pytest.mark.parametrize("ppm", [-200., 200.])
def test_prediction_from_the_start(ppm):
    for seed in range(5):
        clock = Clock(ppm, to=0.0002, back=0.0002, seed=seed)
        clock.run(0.39)
        assert max(map(abs, clock.run(20.))) < 0.001


def test_late_replies_do_not_bend_the_line():
    clock = Clock(50., to=0.0001, back=0.0001)
    clock.run(60.)
    for i in range(200):
        clock.sample(late=0.05 if i % 7 == 0 else 0.)
        assert abs(clock.run(0.1)[-1]) < LIMIT


def test_questions_are_as_many_as_the_jitter_needs():
    intervals = []
    for jitter in (0., 0.0003, 0.003, 0.03):
        clock = Clock(to=jitter, back=jitter)
        clock.run(60.)
        intervals.append(clock.fit.get_interval())
    assert intervals == sorted(intervals, reverse=True)
    assert 0.6 * MAX_INTERVAL < intervals[0] <= MAX_INTERVAL
    assert intervals[-1] == MIN_INTERVAL


def test_jitter_of_each_way_is_known():
    clock = Clock(to=0.004, back=0.001)
    clock.run(120.)
    assert clock.fit.jitter_to == pytest.approx(0.002, rel=0.4)
    assert clock.fit.jitter_from == pytest.approx(0.0005, rel=0.4)
    assert clock.fit.width == pytest.approx(TO + BACK, abs=20e-6)


def test_drift_is_known():
    clock = Clock(100., drift=2. * DRIFT, to=0.0005, back=0.0005)
    clock.run(240.)
    assert clock.fit.drift == pytest.approx(2. * DRIFT, rel=0.3)
    _, freq = clock.fit.line_at(clock.now)
    truth = 1. + 100e-6 + 2. * DRIFT * (clock.now - clock.start)
    assert freq / FREQ == pytest.approx(truth, abs=0.5e-6)


def test_sudden_drift_shortens_the_window():
    """A fan blows at the board: 5 ppm within seconds, on a link of 10 ms jitter."""
    clock = Clock(0., to=0.01, back=0.01)
    clock.run(240.)
    count = clock.fit.bounds.count
    # the clock goes on from where it is at another rate
    now, base = clock.now, clock.true_clock(clock.now)
    clock.true_clock = lambda time: base + FREQ * (time - now) * (1. + 5e-6)
    errors = clock.run(120.)
    assert clock.fit.bounds.count < count
    assert max(map(abs, errors)) < 150e-6 and abs(errors[-1]) < 60e-6


def test_line_is_the_clock_and_its_rate():
    clock = Clock(100., to=0.0002, back=0.0002)
    clock.run(60.)
    fit, now = clock.fit, clock.now
    value, freq = fit.line_at(now)
    assert value == fit.clock_at(now)
    slope = (fit.clock_at(now + 0.5) - fit.clock_at(now - 0.5))
    assert freq == pytest.approx(slope, rel=1e-9)
    assert freq / FREQ == pytest.approx(1.0001, abs=2e-6)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_grid_mean_weighs_in_any_order(order):
    grid = GridMean()
    points = [(0., 1., 0., -1., 4.), (math.log(2.), 2., 1., 0., 1.),
              (-800., 9., 9., 9., 9.)]
    for i in order:
        grid.add(*points[i])
    grid.finish()
    assert grid.upper == pytest.approx(5. / 3.) and grid.lower == pytest.approx(2. / 3.)
    assert grid.gain == pytest.approx(-1. / 3.) and grid.drift == pytest.approx(2.)
    assert grid.gain2 == pytest.approx(math.sqrt(2.) / 3.)
    assert grid.drift2 == pytest.approx(math.sqrt(2.))
