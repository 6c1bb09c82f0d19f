# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs that go on, in C, and with all intervals by whole numbers."""

import ctypes

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from run_core import CORE, Curve, Track, find_intervals, get_step, make_view, paths


def make_track(add):
    track = Track()
    CORE.runtrack_init(ctypes.byref(track), add)
    return track


def run(track, view, done, n):
    got = CORE.runtrack_run(ctypes.byref(track), ctypes.byref(view), done, n)
    assert CORE.runtrack_check(ctypes.byref(track)) == 0
    return got


@settings(deadline=None)
@given(paths(), st.integers(-1, 1))
def test_all_intervals_that_meet_the_windows(path, bent):
    start, windows, _, add = path
    add += bent
    track = make_track(add)
    got = run(track, make_view(start, windows), 0, len(windows))
    assert (got, track.low, track.high) == find_intervals(start, windows, add)


@settings(deadline=None)
@given(paths(max_steps=120), st.lists(st.integers(1, 40), min_size=1, max_size=6))
def test_in_pieces_it_is_the_same(path, sizes):
    """However many windows come at a time, until one cannot be met."""
    start, windows, _, add = path
    track, done = make_track(add), 0
    for size in sizes * len(windows):
        piece = windows[done:done + size]
        if not piece:
            break
        got = run(track, make_view(start, piece), done, len(piece))
        done += got
        if got < len(piece):
            break
    assert (done, track.low, track.high) == find_intervals(start, windows, add)


def test_a_run_of_all_steps_that_a_message_has_room_for():
    n, start = 65535, 2 ** 45
    windows = [(start + get_step(4000, -1 if k > 3 else 0, k), 40) for k in
               range(1, n + 1)]
    track = make_track(-1)
    expected = find_intervals(start, windows[:1000], -1)
    assert run(track, make_view(start, windows), 0, 1000) == expected[0] == 1000
    assert (track.low, track.high) == expected[1:]


@settings(deadline=None)
@given(st.integers(-50, 50), st.integers(1, 3000), st.integers(0, 9),
       st.integers(1, 300), st.integers(-500, 500))
def test_aim_comes_as_close_as_any_interval(add, low, more, k, off):
    track = Track(add, low, low + more)
    wanted = get_step(low, add, k) + off
    curve = Curve()
    missed = CORE.runtrack_aim(ctypes.byref(track), k, wanted, ctypes.byref(curve))
    assert curve.add == add and low <= curve.interval <= low + more
    assert missed == abs(get_step(int(curve.interval), add, k) - wanted)
    assert missed == min(abs(get_step(i, add, k) - wanted)
                         for i in range(low, low + more + 1))


@pytest.mark.parametrize("track, good", [
    ((0, 1, 2 ** 32 - 1), True), ((-32767, 7, 7), True), ((3, 8, 7), False),
    ((3, 0, 7), False), ((3, 7.5, 9), False), ((40000, 7, 9), False)])
def test_check(track, good):
    assert (CORE.runtrack_check(ctypes.byref(Track(*track))) == 0) is good
