# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of linear machines, decoded from the messages, against exact paths."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_moves import journeys, travel
from motion_rig import Rig, make_move

from klippy_ext.kin_linear import LinearKinematics

ROWS = [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 0.0), (1.0, -1.0, 0.0),
        (1.0, 0.0, 3.0), (-0.4, 0.7, 1.9)]


def make_rig(rows, step_dist=0.0125, **options):
    return Rig([LinearKinematics(*row) for row in rows], step_dist, **options)


def check_all(rig, rows):
    for oid, row in enumerate(rows):
        rig.check(lambda path, t, row=row: path.xyz(t) @ np.array(row), oid)


@settings(max_examples=150, deadline=None)
@given(journeys(), st.sampled_from([16e6, 180e6]), st.sampled_from([0.0125, 0.003]),
       st.sampled_from([0.003, 0.25, 2.0]))
def test_random_moves(journey, freq, step_dist, flush_period):
    rig = make_rig(ROWS, step_dist, freq=freq, start=(3.1, -20.7, 0.3))
    end = travel(rig, journey, 0.3)
    rig.run(end + 0.1, flush_period)
    check_all(rig, ROWS)


@settings(max_examples=20, deadline=None)
@given(journeys(max_size=4))
def test_random_moves_late_in_a_long_print(journey):
    begin, freq = 2.0e5, 520e6          # 10^14 ticks
    rig = make_rig(ROWS, freq=freq)
    for sc in rig.steppers:
        sc.reset(int((begin - 1.0) * freq))
    end = travel(rig, journey, begin)
    rig.run(end + 0.1, begin=begin - 0.1)
    for oid, row in enumerate(ROWS):
        clocks, directions = rig.steps(oid)
        made = float(np.sum(directions)) * rig.step_dist
        assert abs(rig.position @ np.array(row) - made) <= 0.5 * rig.step_dist + 1e-7
        assert np.all(np.diff(clocks) > 0)


def test_rest_of_more_than_32_bits():
    rig = make_rig([(1.0, 0.0, 0.0)], freq=180e6)
    move = (0.01, 0.1, 0.01)
    t, position = rig.add(1.0, make_move(*move, rig.start, (1, 0, 0), 0.0, 10.0, 1e3))
    t, position = rig.add(t + 100.0, make_move(*move, position, (1, 0, 0), 0.0, 10.0,
                                               1e3))
    rig.run(t + 0.1)
    check_all(rig, [(1.0, 0.0, 0.0)])


def test_swing_across_a_border_steps_forth_and_back():
    rig = make_rig([(1.0, 0.0, 0.0)], step_dist=0.1)
    t, position = 1.0, rig.start
    for direction in (1.0, -1.0) * 3:
        t, position = rig.add(t, make_move(0.05, 0.0, 0.05, position,
                                           (direction, 0, 0), 0.0, 1.2, 24.0))
    rig.run(t + 0.1)
    check_all(rig, [(1.0, 0.0, 0.0)])
    assert list(rig.steps()[1]) == [1, -1] * 3


def test_move_that_ends_on_a_border_does_not_chatter():
    rig = make_rig([(1.0, 0.0, 0.0)], step_dist=0.01)
    t, position = 1.0, rig.start
    for _ in range(50):
        t, position = rig.add(t, make_move(0.0, 0.005, 0.0, position, (1, 0, 0), 1.0,
                                           1.0, 0.0))
    rig.run(t + 0.1)
    check_all(rig, [(1.0, 0.0, 0.0)])
    assert np.all(rig.steps()[1] == 1)


def test_idle_stepper_makes_nothing():
    rig = make_rig([(0.0, 1.0, 0.0)])
    t, _ = rig.add(1.0, make_move(0.1, 1.0, 0.1, rig.start, (1, 0, 0), 0.0, 50.0,
                                  500.0))
    assert rig.kinematics[0].check_active(10.0) == 0.0
    rig.run(t + 0.1)
    assert rig.commands == []


def test_queries():
    kin = LinearKinematics(1.0, -1.0, 0.0)
    assert kin.calc_position_from_coord(5.0, 2.0, 9.0) == 3.0
    assert [kin.is_active_axis(a) for a in "xyz"] == [True, True, False]
    assert kin.is_active_axis(b"x") and kin.scan_window() == (0.0, 0.0)
    kin.set_stepcompress(None, 0.1)
    kin.set_position(1.0, 0.5, 0.0)
    assert kin.get_commanded_pos() == 0.5


def test_active_check_and_commanded_position():
    rig = make_rig([(1.0, 0.0, 0.0)])
    move = make_move(0.1, 1.0, 0.1, rig.start, (1, 0, 0), 0.0, 50.0, 500.0)
    t, position = rig.add(2.0, move)
    assert rig.kinematics[0].check_active(1.9) == 0.0
    assert rig.kinematics[0].check_active(2.1) == 2.0
    rig.run(t)
    assert rig.kinematics[0].check_active(10.0) == 0.0
    assert abs(rig.kinematics[0].get_commanded_pos() - position[0]) <= 0.5 * 0.0125


def test_jump_is_an_error():
    rig = make_rig([(1.0, 0.0, 0.0)])
    rig.tq.append(1.0, make_move(0.0, 1.0, 0.0, (100.0, 0, 0), (1, 0, 0), 1.0, 1.0,
                                 0.0))
    with pytest.raises(ValueError, match="oid 0.*jumps"):
        rig.sync.generate(2.0)


def test_new_position_without_steps():
    rig = make_rig([(1.0, 0.0, 0.0)])
    t, _ = rig.add(1.0, make_move(0.1, 0.1, 0.1, rig.start, (1, 0, 0), 0.0, 50.0,
                                  500.0))
    rig.run(t + 0.1)
    before = len(rig.steps()[0])
    rig.tq.set_position(t + 0.2, 200.0, 0.0, 0.0)
    rig.kinematics[0].set_position(200.0, 0.0, 0.0)
    rig.tq.append(t + 0.5, make_move(0.1, 0.1, 0.1, (200.0, 0, 0), (-1, 0, 0), 0.0,
                                     50.0, 500.0))
    rig.run(t + 1.0, begin=t + 0.1)
    clocks, directions = rig.steps()
    assert len(clocks) == 2 * before and np.sum(directions) == 0


def test_wrong_use():
    kin = LinearKinematics(1.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="step distance"):
        kin.set_stepcompress(None, 0.0)
    with pytest.raises(RuntimeError):
        kin.__init__(0.0, 1.0, 0.0)


def test_other_weights_from_a_rest_on():
    rig = make_rig([(1.0, 0.0, 0.0)], start=(3.0, 5.0, 0.0))
    kin = rig.kinematics[0]
    t, position = rig.add(1.0, make_move(0.1, 0.4, 0.1, rig.start, (0.6, 0.8, 0.0), 0.0,
                                         20.0, 200.0))
    rig.run(2.0)
    made = rig.steppers[0].get_last_position()
    # mirrored about where it now is
    kin.set_weights(-1.0, 0.0, 0.0, 2.0 * position[0])
    assert kin.calc_position_from_coord(*position) == pytest.approx(position[0])
    rig.add(2.5, make_move(0.1, 0.4, 0.1, position, (-0.6, -0.8, 0.0), 0.0, 20.0,
                           200.0))
    rig.run(4.0, begin=2.0)
    # the way back goes on, and no step is lost between
    assert rig.steppers[0].get_last_position() == 2 * made == 960
    kin.set_weights(0.0, 0.0, 0.0, 99.0)
    assert not any(kin.is_active_axis(axis) for axis in "xyz")
