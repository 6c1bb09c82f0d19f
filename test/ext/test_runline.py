# SPDX-License-Identifier: GPL-3.0-or-later
"""How far runs get, in C, and with every add there is."""

import ctypes
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from run_core import CORE, LINE_MAX, Curve, count_met, find_intervals, make_line, paths


def check(line):
    assert CORE.runline_check(ctypes.byref(line)) == 0


def find_longest(start, windows, guess, n=None):
    """(length, curve) as the core has it, every step met."""
    line, curve = make_line(start, windows), Curve()
    n = len(windows) if n is None else n
    got = CORE.runline_find_longest(ctypes.byref(line), n, guess, ctypes.byref(curve))
    check(line)
    if got:
        assert CORE.runcurve_check(ctypes.byref(curve)) == 0
        assert count_met(start, windows[:got], 1, int(curve.interval),
                         int(curve.add)) == got
    return got, curve


def find_best(start, windows, adds):
    """The longest run of any of these adds."""
    return max(find_intervals(start, windows, add)[0] for add in adds)


@settings(deadline=None)
@given(paths(), st.integers(-1, 1))
def test_all_intervals_of_an_add(path, bent):
    start, windows, _, add = path
    line = make_line(start, windows)
    least, most = ctypes.c_double(), ctypes.c_double()
    got = CORE.runline_find_intervals(
        ctypes.byref(line), add + bent, len(windows), ctypes.byref(least),
        ctypes.byref(most))
    check(line)
    assert (got, least.value, most.value) == find_intervals(start, windows, add + bent)


@settings(deadline=None)
@given(paths(max_add=40), st.integers(-60, 60))
def test_a_run_meets_its_windows(path, guess):
    """find_longest() looks at each; one step alone is the caller's."""
    start, windows, interval, add = path
    good = count_met(start, windows, 1, interval, add)
    got, _ = find_longest(start, windows, guess)
    assert got >= min(good, 2) if good > 1 else got != 1


def draw_windows(draw):
    """Steps of a path that changes its pace at random."""
    clock, gap, windows = 0, draw.uniform(50, 2000), []
    for _ in range(60):
        gap = max(20., gap * draw.uniform(0.97, 1.03) + draw.uniform(-2, 2))
        clock += gap
        windows.append(round(clock))
    room = [b - a for a, b in zip([0, *windows], windows, strict=False)] + [10 ** 6]
    most = draw.choice([3, 20, 200])
    return [(clock, min(most, (min(room[i:i + 2]) - 1) // 2))
            for i, clock in enumerate(windows)]


def test_runs_are_about_the_longest():
    """Of 100 paths: 1 % shorter than the longest of all adds, at most."""
    draw, got, best = random.Random(5), 0, 0
    for _ in range(100):
        windows = draw_windows(draw)
        got += find_longest(0, windows, draw.randint(-20, 20))[0]
        best += find_best(0, windows, range(-150, 151))
    assert got >= 0.99 * best


def test_no_more_gates_than_there_is_room_for():
    windows = [(1000 * k, 5) for k in range(1, 1001)]
    got, curve = find_longest(0, windows, 0, LINE_MAX)
    assert (got, curve.interval, curve.add) == (LINE_MAX, 1000, 0)


@pytest.mark.parametrize("gap", [40000, 10 ** 6])
def test_an_add_that_no_message_has_room_for(gap):
    """Steps that slow down too fast for any run of more than two."""
    windows = [(1000 * k + gap * k ** 3, 3) for k in range(1, 9)]
    got, curve = find_longest(0, windows, 0)
    assert got <= 2 and abs(curve.add) <= 32766


def test_check_finds_a_gate_the_wrong_way_round():
    line = make_line(0, [(1000 * k, 5) for k in range(1, 9)])
    least = ctypes.c_double()
    CORE.runline_find_intervals(ctypes.byref(line), 0, 8, ctypes.byref(least),
                                ctypes.byref(least))
    check(line)
    line.low[3] = line.high[3] + 1
    assert CORE.runline_check(ctypes.byref(line)) == -24
    line.n = LINE_MAX + 1
    assert CORE.runline_check(ctypes.byref(line)) == -23
