# SPDX-License-Identifier: GPL-3.0-or-later
"""The bed of a polar machine: exact outside of the core, calm within."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from motion_moves import journeys, travel
from motion_rig import Rig, make_move
from truth import curves
from truth.path import Path

from klippy_ext.kin_polar import CORE, PolarBedKinematics
from klippy_ext.kin_winch import RadiusKinematics

STEP = 0.0004


def make_rig(start, step_dist=STEP, **options):
    return Rig([PolarBedKinematics()], step_dist, start=start, **options)


def check_bed(rig):
    start = math.atan2(rig.start[1], rig.start[0])
    return rig.check(lambda path, t: curves.bed_angle(path, t, start))


def find_nearest(path):
    """Least distance (mm) of a path from the z axis."""
    least = np.inf
    for i in range(len(path.t0)):
        s = np.linspace(0.0, path.distance_in_piece(i, path.duration[i]), 200)
        least = min(least, np.hypot(path.x[i] + s * path.rx[i],
                                    path.y[i] + s * path.ry[i]).min())
    return least


@settings(max_examples=80, deadline=None)
@given(journeys(), st.sampled_from([16e6, 180e6]),
       st.tuples(st.floats(-40.0, 40.0), st.floats(-40.0, 40.0), st.just(0.0)))
def test_random_moves(journey, freq, start):
    rig = make_rig(start, freq=freq)
    end = travel(rig, journey, 0.3)
    assume(find_nearest(Path(rig.pieces)) > 1.0)
    rig.run(end + 0.1)
    check_bed(rig)


def test_turns_are_counted_on():
    start = (10.0, 0.0, 0.0)
    rig, t, position = make_rig(start), 1.0, start
    for i in range(1, 41):
        goal = (10.0 * math.cos(0.5 * i), 10.0 * math.sin(0.5 * i), 0.0)
        way = math.dist(position, goal)
        ratio = tuple((b - a) / way for a, b in zip(position, goal, strict=True))
        move = make_move(0.05, way / 50.0 - 0.05, 0.05, position, ratio, 0.0, 50.0,
                         1000.0)
        t, position = rig.add(t, move)
    rig.run(t + 0.1)
    check_bed(rig)
    assert rig.kinematics[0].get_commanded_pos() == pytest.approx(20.0, abs=STEP)


def run_both(moves, start, v=2.0):
    """(times, angles, worst distance from the path) for ways [(dx, dy)]."""
    rig = Rig([PolarBedKinematics(), RadiusKinematics()], STEP, start=(*start, 0.0))
    t, position = 1.0, (*start, 0.0)
    for dx, dy in moves:
        way = math.hypot(dx, dy)
        t, position = rig.add(t, make_move(
            0.01, way / v - 0.01, 0.01, position, (dx / way, dy / way, 0.0), 0.0, v,
            v / 0.01))
    rig.run(t + 0.1)
    path, at = Path(rig.pieces), np.linspace(0.9, t + 0.05, 20001)
    counts = []
    for oid in range(2):
        clocks, directions = rig.steps(oid)
        done = np.concatenate([[0], np.cumsum(directions)])
        counts.append(done[np.searchsorted(clocks / rig.freq, at, side="right")])
    angle = math.atan2(start[1], start[0]) + STEP * counts[0]
    radius = math.hypot(*start) + STEP * counts[1]
    xyz = path.xyz(at)
    off = np.hypot(radius * np.cos(angle) - xyz[:, 0],
                   radius * np.sin(angle) - xyz[:, 1])
    return at, angle, off.max(), rig


@pytest.mark.parametrize("name, start, moves", [
    ("through the centre", (0.3, 0.0), [(-0.6, 0.0)]),
    ("through the centre, aslant", (0.3, 0.1), [(-0.6, -0.2)]),
    ("through the core", (0.3, 0.004), [(-0.6, 0.0)]),
    ("past the core", (0.3, 0.0101), [(-0.6, 0.0)]),
    ("to the centre and on", (0.3, 0.0), [(-0.3, 0.0), (0.0, 0.2)]),
    ("to the centre and back", (0.2, 0.1), [(-0.2, -0.1), (0.2, 0.1)]),
    ("from the centre", (0.0, 0.0), [(-0.1, -0.2), (0.3, 0.1)]),
    ("around in the core", (0.2, 0.0), [(-0.2, 0.03), (0.0, -0.06), (-0.2, 0.0)]),
])
def test_near_the_centre(name, start, moves):
    at, angle, off, rig = run_both(moves, start)
    assert off < 2.0 * CORE + STEP
    # nothing happens at once: so many radians of a turn take their time
    rate = np.abs(np.diff(angle)).max()
    assert rate < 2.0 * math.pi / CORE * (at[1] - at[0]) * 2.0 + 2.0 * STEP
    x, y = start[0] + sum(m[0] for m in moves), start[1] + sum(m[1] for m in moves)
    if math.hypot(x, y) > CORE:
        away = (angle[-1] - math.atan2(y, x)) / (2.0 * math.pi)
        assert away == pytest.approx(round(away), abs=STEP)


coords = st.one_of(st.floats(-0.03, 0.03), st.floats(-0.5, 0.5),
                   st.sampled_from([0.0, CORE, -CORE]))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(coords, coords), min_size=2, max_size=7))
def test_random_ways_around_the_centre(corners):
    ways = [(x1 - x0, y1 - y0) for (x0, y0), (x1, y1)
            in zip(corners, corners[1:], strict=False)]
    assume(all(math.hypot(*way) > 0.025 for way in ways))
    at, angle, off, rig = run_both(ways, corners[0])
    assert off < 2.0 * CORE + 2.0 * STEP
    x, y = corners[-1]
    if math.hypot(x, y) > CORE * 1.01:
        away = (angle[-1] - math.atan2(y, x)) / (2.0 * math.pi)
        assert abs(away - round(away)) * 2.0 * math.pi <= STEP


def test_slices_do_not_matter():
    results = []
    for period in (0.25, 0.013):
        rig = Rig([PolarBedKinematics()], STEP, start=(0.3, 0.003, 0.0))
        t, _ = rig.add(1.0, make_move(0.01, 0.29, 0.01, rig.start, (-1.0, 0.0, 0.0),
                                      0.0, 2.0, 200.0))
        rig.run(t + 0.1, flush_period=period)
        results.append(rig.steps())
    assert len(results[0][0]) == len(results[1][0]) > 1000
    # both within the bound of the same exact times
    assert np.abs(results[0][0] - results[1][0]).max() <= 2 * 25e-6 * 16e6
