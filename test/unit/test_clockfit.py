# SPDX-License-Identifier: GPL-3.0-or-later
import random

import pytest

from klippy.clockfit import ClockFit

FREQ = 20e6
BOOT = 90.


def sample_clock(ppm, jitter, count, seed, spike=0.):
    """Feed a fit with samples of a clock; yields (time, fit, error in s)."""
    rng = random.Random(seed)
    rate = FREQ * (1. + ppm * 1e-6)
    fit, now = None, 100.
    for i in range(count):
        forward, back = (0.0002 + rng.uniform(0., jitter) for _ in range(2))
        if spike and i > 20 and i % 7 == 0:
            back += spike
        clock = int((now + forward - BOOT) * rate)
        if fit is None:
            fit = ClockFit(FREQ, now, clock)
        else:
            fit.add(now, now + forward + back, clock)
        now += 0.05 if i < 9 else 0.9839
        truth = (now + 2. - BOOT) * rate
        yield now, fit, abs(fit.clock_at(now + 2.) - truth) / FREQ


@pytest.mark.parametrize("ppm", [-200., 0., 200.])
@pytest.mark.parametrize("jitter,bound", [(0.0002, 60e-6), (0.004, 1000e-6)])
def test_prediction_after_a_minute(ppm, jitter, bound):
    for seed in range(5):
        errors = [e for t, _, e in sample_clock(ppm, jitter, 400, seed) if t > 160.]
        assert max(errors) < bound


@pytest.mark.parametrize("ppm", [-200., 200.])
def test_prediction_from_the_start(ppm):
    for seed in range(5):
        errors = [e for t, _, e in sample_clock(ppm, 0.0002, 40, seed) if t > 100.45]
        assert max(errors) < 0.001


def test_late_replies_do_not_bend_the_line():
    calm = [e for t, _, e in sample_clock(50., 0.0001, 300, 1) if t > 160.]
    late = [e for t, _, e in sample_clock(50., 0.0001, 300, 1, spike=0.05) if t > 160.]
    assert max(late) < max(calm) * 3. + 20e-6


def test_time_is_the_inverse_of_clock():
    *_, (now, fit, _) = sample_clock(100., 0.0002, 100, 2)
    assert abs(fit.time_at(fit.clock_at(now + 3.)) - now - 3.) < 1e-9
    assert abs(fit.freq / FREQ - 1.0001) < 2e-6
