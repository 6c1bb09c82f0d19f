# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of cables, arms and carriages against exact paths."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from motion_moves import journeys, travel
from motion_rig import Rig, make_move
from truth import curves
from truth.path import Path

from klippy_ext.kin_deltesian import DeltesianKinematics
from klippy_ext.kin_rotary_delta import RotaryDeltaKinematics
from klippy_ext.kin_winch import RadiusKinematics, WinchKinematics

ANCHORS = ((-900.0, -700.0, 20.0), (850.0, -750.0, 40.0), (0.0, 950.0, 1500.0))
ARMS = [(80.0, 260.0, math.radians(d), 90.0, 240.0) for d in (30.0, 150.0, 270.0)]
TOWERS = ((250.0, -140.0), (260.0, 150.0))
# Of each kind: (kinematics, exact position, parameters of each), step distance
KINDS = {
    "winch": (WinchKinematics, lambda *a: curves.cable(a), ANCHORS, 0.01),
    "rotary_delta": (RotaryDeltaKinematics, curves.rotary_arm, ARMS, 0.0001),
    "deltesian": (lambda arm, x: DeltesianKinematics(arm * arm, x),
                  curves.deltesian_carriage, TOWERS, 0.01),
    "radius": (RadiusKinematics, lambda: curves.radius, [()], 0.01),
}


def make_rig(kind, start, **options):
    make, _, parameters, step_dist = KINDS[kind]
    return Rig([make(*p) for p in parameters], step_dist, start=start, **options)


def is_reached(kind, rig):
    """True if all corners of the path, and a little below, are in reach."""
    _, exact, parameters, _ = KINDS[kind]
    path = Path(rig.pieces)
    corners = np.concatenate([path.xyz(path.t0), path.xyz(path.t1)])
    with np.errstate(invalid="ignore"):
        return all(np.all(np.isfinite(exact(*p)(corners - [0.0, 0.0, down])))
                   for p in parameters for down in (0.0, 5.0))


def check_all(kind, rig):
    _, exact, parameters, _ = KINDS[kind]
    for oid, position in enumerate([exact(*p) for p in parameters]):
        rig.check(lambda path, t, f=position: f(path.xyz(t)), oid)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=60, deadline=None)
@given(journey=journeys(), freq=st.sampled_from([16e6, 180e6]),
       start=st.tuples(*[st.floats(-20.0, 20.0)] * 3))
def test_random_moves(kind, journey, freq, start):
    rig = make_rig(kind, start, freq=freq)
    end = travel(rig, journey, 0.3)
    assume(is_reached(kind, rig))
    rig.run(end + 0.1)
    check_all(kind, rig)


@pytest.mark.parametrize("kind, start, ratio", [
    # past the point that is nearest to an anchor; past the axis, on both sides
    ("winch", (-50.0, -60.0, 30.0), (0.8, 0.6, 0.0)),
    ("radius", (-50.0, 0.3, 0.0), (1.0, 0.0, 0.0)),
    ("radius", (-50.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    ("rotary_delta", (-45.0, 30.0, 5.0), (0.96, -0.28, 0.0)),
    ("rotary_delta", (-40.0, -30.0, 5.0), (0.8, 0.5568, 0.224)),
    ("rotary_delta", (50.0, 55.0, 5.0), (-0.6, -0.8, 0.0)),
    ("deltesian", (-100.0, 0.0, 5.0), (0.9, 0.0, 0.4359)),
    ("deltesian", (50.0, 0.0, 5.0), (0.0, 1.0, 0.0))])
def test_long_lines(kind, start, ratio):
    rig = make_rig(kind, start)
    t, _ = rig.add(1.0, make_move(0.1, 0.9, 0.1, start, ratio, 0.0, 100.0, 1000.0))
    rig.run(t + 0.1)
    check_all(kind, rig)


def test_arm_turns_once_on_its_way():
    rig = make_rig("rotary_delta", (-50.0, 0.0, 5.0))
    t, _ = rig.add(1.0, make_move(0.1, 0.9, 0.1, rig.start, (1.0, 0.0, 0.0), 0.0,
                                  100.0, 1000.0))
    rig.run(t + 0.1)
    check_all("rotary_delta", rig)
    directions = rig.steps(2)[1]
    assert np.count_nonzero(np.diff(directions)) == 1


def test_positions_and_axes():
    kin = WinchKinematics(1.0, 2.0, 3.0)
    assert kin.calc_position_from_coord(3.0, 5.0, 9.0) == 7.0
    assert all(kin.is_active_axis(a) for a in "xyz")
    kin = RadiusKinematics()
    assert kin.calc_position_from_coord(3.0, 4.0, 9.0) == 5.0
    assert [kin.is_active_axis(a) for a in "xyz"] == [True, True, False]
    kin = DeltesianKinematics(25.0, 3.0)
    assert kin.calc_position_from_coord(0.0, 99.0, 2.0) == 6.0
    assert [kin.is_active_axis(a) for a in "xyz"] == [True, False, True]


def test_elbow_is_an_arm_from_the_shoulder_and_the_head():
    for arm in ARMS:
        kin = RotaryDeltaKinematics(*arm)
        for point in ((0.0, 0.0, 0.0), (60.0, -20.0, 30.0), (-70.0, 40.0, 10.0)):
            angle = kin.calc_position_from_coord(*point)
            out = arm[0] + arm[3] * math.cos(angle)
            elbow = (out * math.cos(arm[2]), out * math.sin(arm[2]),
                     arm[1] + arm[3] * math.sin(angle))
            assert math.dist(elbow, point) == pytest.approx(arm[4])
