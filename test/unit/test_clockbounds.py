# SPDX-License-Identifier: GPL-3.0-or-later
import random

import pytest

from klippy.clockbounds import ClockBounds

GAIN = 50e-6


def fill(bounds, count, length, interval=0.1, seed=1, start=0.):
    """Add samples of a clock that gains; returns (sent, received, delays) of each."""
    rng = random.Random(seed)
    samples = []
    for i in range(count):
        sent = start + i * interval
        to, back = 0.001 + rng.random() * 0.01, 0.002 + rng.random() * 0.01
        ahead = 7. + GAIN * (sent + to)
        bounds.add(sent, sent + to + back, ahead + sent + to, GAIN, length)
        samples.append((sent, sent + to + back, to, back))
    return samples


def test_each_stretch_keeps_its_quickest_samples():
    bounds = ClockBounds()
    samples = fill(bounds, 600, 30.)
    assert len(bounds.stretches) > 20
    for i, s in enumerate(bounds.stretches):
        end = bounds.stretches[i + 1].start if i + 1 < len(bounds.stretches) else 1e9
        mine = [x for x in samples if s.start <= x[0] < end]
        assert s.count == len(mine)
        quick_to, quick_back = min(x[2] for x in mine), min(x[3] for x in mine)
        assert s.upper - 7. - GAIN * s.sent == pytest.approx(
            quick_to * (1. + GAIN), abs=1e-12)
        assert 7. + GAIN * s.received - s.lower == pytest.approx(
            quick_back * (1. + GAIN), abs=1e-12)


def test_bounds_hold_on_both_sides():
    bounds = ClockBounds()
    fill(bounds, 300, 30., seed=2)
    for s in bounds.stretches:
        assert s.lower - GAIN * s.received < 7. < s.upper - GAIN * s.sent


@pytest.mark.parametrize("length", [30., 120.])
def test_window_ends(length):
    bounds = ClockBounds()
    samples = fill(bounds, 5000, length)
    now = samples[-1][0]
    kept = [x for x in samples if x[0] >= bounds.get_start()]
    assert bounds.count == len(kept) == sum(s.count for s in bounds.stretches)
    assert 0.9 * length < now - bounds.get_start() < 1.1 * length
    assert len(bounds.stretches) < 60


def test_first_stretches_are_short():
    """A slope is known soon."""
    bounds = ClockBounds()
    fill(bounds, 9, 30., interval=0.05)
    assert len(bounds.stretches) == 9


def test_forget_leaves_the_newest():
    bounds = ClockBounds()
    fill(bounds, 400, 30.)
    newest = bounds.stretches[-1]
    bounds.forget(1e9)
    assert bounds.stretches == [newest] and bounds.count == newest.count
