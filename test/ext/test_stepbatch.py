# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows of many steps, in C, and as whole numbers and exact roots say."""

import ctypes
import decimal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from run_core import CORE

FREQ, OFFSET = 180e6, -3.5
SPARE = -1.25                   # what nobody may overwrite


class Scale(ctypes.Structure):
    _fields_ = [("offset", ctypes.c_double), ("freq", ctypes.c_double)]


class Way(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double)
                for name in ("first", "speed", "half_accel", "start")]


class Batch(ctypes.Structure):
    _fields_ = [("scale", Scale), ("max_error", ctypes.c_uint32),
                ("before", ctypes.c_double),
                ("clocks", ctypes.POINTER(ctypes.c_double)),
                ("errors", ctypes.POINTER(ctypes.c_double))]


CORE.stepbatch_set_times.argtypes = [ctypes.POINTER(Batch),
                                     ctypes.POINTER(ctypes.c_double), ctypes.c_int]
CORE.stepbatch_set_way.argtypes = [ctypes.POINTER(Batch), ctypes.POINTER(Way),
                                   ctypes.c_int64, ctypes.c_int]


def find_clock(time):
    """The closest whole clock; the even one of two."""
    return round((time - OFFSET) * FREQ)


def find_error(before, after, most):
    return min(most, (min(before, after) - 1) // 2)


def fill(n, held, before, most, set_steps):
    """(clocks, errors, whether all come in order) as the core sets them; the first
    is of the step that is held."""
    clocks, errors = ((ctypes.c_double * (n + 3))(*[SPARE] * (n + 3))
                      for _ in range(2))
    clocks[0] = held
    batch = Batch(Scale(OFFSET, FREQ), most, before, clocks, errors)
    ok = set_steps(ctypes.byref(batch))
    assert clocks[n + 2] == errors[n + 1] == errors[n + 2] == SPARE
    return list(clocks[:n + 1]), list(errors[:n]), bool(ok)


def check_errors(clocks, errors, before, most):
    gaps = [before, *(b - a for a, b in zip(clocks, clocks[1:], strict=False))]
    assert errors == [find_error(gaps[i], gaps[i + 1], most)
                      for i in range(len(errors))]


def fill_times(times, held, before, most):
    array = (ctypes.c_double * len(times))(*times)
    return fill(len(times), held, before, most,
                lambda b: CORE.stepbatch_set_times(b, array, len(times)))


@settings(deadline=None)
@given(st.lists(st.floats(1e-7, 1e-2), min_size=1, max_size=40),
       st.integers(1, 10 ** 8), st.integers(0, 6000), st.floats(0., 1e5))
def test_windows_of_times(gaps, before, most, start):
    times = [start + sum(gaps[:i + 1]) for i in range(len(gaps))]
    held = find_clock(start)
    clocks, errors, ok = fill_times(times, held, before, most)
    assert clocks == [held, *map(find_clock, times)]
    assert ok
    check_errors(clocks, errors, before, most)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 8, 9])
@pytest.mark.parametrize("late", range(9))
def test_steps_at_one_time_are_told(n, late):
    """Wherever two meet, or are out of order."""
    for gap in (0, -1):
        clocks = [1000 + 100 * i for i in range(n + 1)]
        if late < n:
            clocks[late + 1] = clocks[late] + gap
        times = [OFFSET + c / FREQ for c in clocks]
        assert fill_times(times[1:], clocks[0], 100, 50)[2] is (late >= n)


def solve(way, i):
    """Exact time of a step on a way."""
    with decimal.localcontext(prec=60):
        x, v, h = (decimal.Decimal(value) for value in (
            way.first, way.speed, way.half_accel))
        x += i
        if not h:
            return decimal.Decimal(way.start) + x / v
        root = max(v * v + 4 * h * x, decimal.Decimal(0)).sqrt()
        return decimal.Decimal(way.start) + 2 * x / (v + root or 1)


@settings(deadline=None)
@given(st.floats(0., 1.), st.floats(1e3, 1e5), st.sampled_from([0., 1e4, -1e4, 1e6]),
       st.floats(0., 1e4), st.integers(1, 41), st.integers(0, 500))
def test_windows_of_a_way(first, speed, half_accel, start, n, done):
    if speed * speed + 4. * half_accel * (first + done + n) <= 0.:
        half_accel = -half_accel
    way = Way(first, speed, half_accel, start)
    held = int((solve(way, done - 1) - decimal.Decimal(OFFSET))
               * decimal.Decimal(FREQ)) if done else find_clock(start) - 1000
    clocks, errors, ok = fill(n, held, 700, 4500, lambda b: CORE.stepbatch_set_way(
        b, ctypes.byref(way), done, n))
    for i, clock in enumerate(clocks[1:]):
        exact = (solve(way, done + i) - decimal.Decimal(OFFSET)) * decimal.Decimal(FREQ)
        assert clock == int(clock) and abs(decimal.Decimal(clock) - exact) < .51
    assert ok
    check_errors(clocks, errors, 700, 4500)


def test_a_way_from_rest_and_to_rest():
    """Where no speed is left the root has no digits, but stays a number."""
    for way in (Way(0., 0., 1e5, 1.), Way(0.5, 2e3, -2e3 ** 2 / 4. / 99.5, 1.)):
        clocks, _, ok = fill(100, find_clock(0.9), 10, 4500,
                             lambda b, w=way: CORE.stepbatch_set_way(
                                 b, ctypes.byref(w), 0, 100))
        assert ok and clocks == sorted(clocks)
        assert clocks[1] == pytest.approx(find_clock(float(solve(way, 0))), abs=1)
        assert clocks[100] == pytest.approx(find_clock(float(solve(way, 99))), abs=30)
