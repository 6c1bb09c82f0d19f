# SPDX-License-Identifier: GPL-3.0-or-later
"""Filament that enters a heater for the first time."""
import pytest

from klippy.extras.heater_surroundings import FilamentFlow


def follow(flow, *positions, elapsed=0.25):
    speeds = []
    for position in positions:
        flow.note_position(position, elapsed)
        speeds.append(flow.speed)
    return speeds


def test_steady_flow():
    assert follow(FilamentFlow(2.0), 10.0, 11.0, 12.0)[1:] == [4.0, 4.0]


def test_what_comes_again_after_a_retraction_is_warm():
    flow = FilamentFlow(2.0)
    assert follow(flow, 10.0, 9.0, 9.5, 10.0, 10.5)[1:] == [0.0, 0.0, 0.0, 2.0]


def test_what_was_pulled_far_back_is_cold():
    flow = FilamentFlow(2.0)
    # 50 mm back: all but 2 mm of it count again
    speeds = follow(flow, 60.0, 10.0, 11.0, 12.0, 13.0)
    assert speeds[1:] == [0.0, 0.0, 0.0, 4.0]


def test_an_extruder_set_anew_is_no_flow():
    assert follow(FilamentFlow(2.0), 0.0, 5000.0, 5001.0)[1:] == [
        0.0, pytest.approx(4.0)]
