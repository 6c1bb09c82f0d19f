# SPDX-License-Identifier: GPL-3.0-or-later
"""A run against windows, in C, and as whole numbers say."""

import ctypes

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from run_core import CORE, Curve, count_met, make_view, paths


def count(curve, view, first, n):
    return CORE.runcurve_count_met(ctypes.byref(curve), ctypes.byref(view),
                                   first - 1, n)


@settings(deadline=None)
@given(paths(), st.integers(-2, 2), st.integers(-1, 1))
def test_windows_are_met_as_whole_numbers_say(path, more, bent):
    start, windows, interval, add = path
    interval, add = interval + more, add + bent
    got = count(Curve(interval, add), make_view(start, windows), 1, len(windows))
    assert got == count_met(start, windows, 1, interval, add)


@settings(deadline=None)
@given(paths(), st.integers(1, 40))
def test_the_windows_of_later_steps(path, first):
    start, windows, interval, add = path
    rest = windows[first - 1:] or windows[-1:]
    first = min(first, len(windows))
    got = count(Curve(interval, add), make_view(start, rest), first, len(rest))
    assert got == count_met(start, rest, first, interval, add)


@pytest.mark.parametrize("missed", range(1, 34))
def test_one_miss_anywhere_ends_it(missed):
    """By one tick, early or late; a window is met on its edge."""
    for side in (-1, 1):
        windows = [(100 * k + side * (6 if k == missed else 5), 5)
                   for k in range(1, 34)]
        assert count(Curve(100, 0), make_view(0, windows), 1, 33) == missed - 1


def test_a_long_run_far_from_zero():
    """65535 steps at a clock of 2^50: nothing is rounded."""
    start, n = 2 ** 50 + 1, 65535
    windows = [(start + 3000 * k + 7 * (k * (k - 1) // 2), 0) for k in range(1, n + 1)]
    view = make_view(start, windows)
    assert count(Curve(3000, 7), view, 1, n) == n
    view.wanted[n - 1] += 1
    assert count(Curve(3000, 7), view, 1, n) == n - 1


@pytest.mark.parametrize("curve, good", [
    ((1, 0), True), ((2 ** 32 - 1, -32767), True), ((500, 32767), True),
    ((0, 0), False), ((2 ** 32, 0), False), ((1.5, 0), False), ((5, .5), False),
    ((5, 32768), False), ((float("nan"), 0), False), ((5, float("nan")), False)])
def test_check(curve, good):
    assert (CORE.runcurve_check(ctypes.byref(Curve(*curve))) == 0) is good
