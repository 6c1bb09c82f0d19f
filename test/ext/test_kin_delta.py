# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of a delta's towers against exact paths."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_moves import journeys, travel
from motion_rig import Rig, make_move

from klippy_ext.kin_delta import DeltaKinematics

ARM = 250.0
TOWERS = [(130.0 * math.cos(a), 130.0 * math.sin(a))
          for a in (math.radians(d) for d in (210.0, 330.0, 90.0))]


def make_rig(**options):
    kinematics = [DeltaKinematics(ARM ** 2, x, y) for x, y in TOWERS]
    return Rig(kinematics, 0.01, **options)


def get_height(tower):
    def height(path, t):
        xyz = path.xyz(t)
        flat2 = (tower[0] - xyz[:, 0]) ** 2 + (tower[1] - xyz[:, 1]) ** 2
        return xyz[:, 2] + np.sqrt(ARM ** 2 - flat2)
    return height


def check_all(rig):
    for oid, tower in enumerate(TOWERS):
        rig.check(get_height(tower), oid)


@settings(max_examples=80, deadline=None)
@given(journeys(), st.sampled_from([16e6, 180e6]),
       st.tuples(*[st.floats(-40.0, 40.0)] * 3))
def test_random_moves(journey, freq, start):
    rig = make_rig(freq=freq, start=start)
    end = travel(rig, journey, 0.3)
    rig.run(end + 0.1)
    check_all(rig)


def test_line_that_passes_a_tower_turns_its_carriage():
    rig = make_rig(start=(TOWERS[0][0] - 50.0, TOWERS[0][1], 5.0))
    t, _ = rig.add(1.0, make_move(0.1, 0.9, 0.1, rig.start, (0.96, 0.28, 0.0), 0.0,
                                  100.0, 1000.0))
    rig.run(t + 0.1)
    # The arms of the other towers do not reach so far
    rig.check(get_height(TOWERS[0]), 0)
    directions = rig.steps(0)[1]
    assert directions[0] == 1 and directions[-1] == -1
    assert np.count_nonzero(np.diff(directions)) == 1


def test_climbing_line_turns_past_the_tower():
    rig = make_rig(start=(TOWERS[0][0] - 50.0, TOWERS[0][1], 5.0))
    t, _ = rig.add(1.0, make_move(0.1, 0.9, 0.1, rig.start, (0.99, 0.0, 0.1411), 0.0,
                                  100.0, 1000.0))
    rig.run(t + 0.1)
    # The arms of the other towers do not reach so far
    rig.check(get_height(TOWERS[0]), 0)


def test_straight_up_and_down():
    rig = make_rig(start=(10.0, 20.0, 0.0))
    t, position = rig.add(1.0, make_move(0.1, 0.2, 0.1, rig.start, (0, 0, 1), 0.0, 20.0,
                                         200.0))
    t, position = rig.add(t, make_move(0.1, 0.2, 0.1, position, (0, 0, -1), 0.0, 20.0,
                                       200.0))
    rig.run(t + 0.1)
    check_all(rig)


def test_position_and_axes():
    kin = DeltaKinematics(25.0, 3.0, 0.0)
    assert kin.calc_position_from_coord(0.0, 0.0, 2.0) == 6.0
    assert all(kin.is_active_axis(a) for a in "xyz")
