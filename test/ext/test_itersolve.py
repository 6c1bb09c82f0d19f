# SPDX-License-Identifier: GPL-3.0-or-later
"""What all kinematics share: speeds, rests, slices, homing."""

import numpy as np
import pytest
from motion_rig import Rig, make_move, run_firmware

from klippy_ext.kin_linear import LinearKinematics

X = np.array([1.0, 0.0, 0.0])


def make_rig(step_dist=0.0125, **options):
    return Rig([LinearKinematics(1.0, 0.0, 0.0)], step_dist, **options)


def cruise(rig, t, way, v, direction=1.0, start=None):
    """Way mm at one speed, without ramps."""
    start = rig.start if start is None else start
    move = make_move(0.0, way / v, 0.0, start, (direction, 0, 0), v, v, 0.0)
    return rig.add(t, move)


def check(rig, **options):
    return rig.check(lambda path, t: path.xyz(t) @ X, **options)


@pytest.mark.parametrize("v, step_dist", [(0.01, 0.0125), (0.01, 0.001),
                                          (500.0, 0.0025), (2000.0, 0.0125)])
@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_very_slow_and_very_fast(v, step_dist, direction):
    rig = make_rig(step_dist, freq=180e6)
    way = max(0.1, 0.3 * v)
    t, _ = cruise(rig, 1.0, way, v, direction)
    rig.run(t + 0.1)
    clocks, directions = check(rig)
    assert abs(len(clocks) - way / step_dist) < 1.0 and np.all(directions == direction)


def test_way_of_one_step_and_less():
    rig = make_rig(0.01)
    t, position = 1.0, rig.start
    for way in (0.004, 0.004, 0.01, 0.0001, 0.01, 0.0199):
        t, position = cruise(rig, t + 0.01, way, 1.0, 1.0, position)
    rig.run(t + 0.1)
    assert len(check(rig)[0]) == 5


def test_move_of_no_length_makes_nothing():
    rig = make_rig()
    t, position = rig.add(1.0, make_move(0.0, 0.0, 0.0, rig.start, (1, 0, 0), 5.0, 5.0,
                                         100.0))
    t, position = rig.add(1.0, make_move(0.0, 0.5, 0.0, position, (0, 0, 0), 0.0, 0.0,
                                         0.0))
    rig.run(t + 0.1)
    assert rig.commands == []


def test_slices_do_not_change_the_steps():
    made = []
    for period in (0.001, 0.0371, 10.0):
        rig = make_rig(0.001, max_error=0.0)
        t, position = rig.add(1.0, make_move(0.1, 0.2, 0.15, rig.start, (0.6, 0.8, 0.0),
                                             0.0, 30.0, 300.0))
        t, _ = rig.add(t, make_move(0.1, 0.1, 0.1, position, (-1, 0, 0), 0.0, 20.0,
                                    200.0))
        rig.run(t + 0.1, flush_period=period)
        made.append(rig.steps())
    for clocks, directions in made[1:]:
        assert np.abs(clocks - made[0][0]).max() <= 1
        assert np.array_equal(directions, made[0][1])


def test_homing_stops_in_the_middle():
    """Steps made too far are dropped by the mcu; then a new position."""
    rig = make_rig(0.01)
    cruise(rig, 1.0, 50.0, 25.0, -1.0)
    rig.run(1.5, flush_period=0.05, ahead=0.05)
    sc, trigger = rig.steppers[0], int(1.47 * rig.freq)
    clocks, directions = rig.steps()
    assert clocks[-1] > trigger
    halted = sc.find_past_position(trigger)
    assert halted == -np.count_nonzero(clocks <= trigger)
    rig.tq.finalize(9e9, 1.0)
    rig.sync.generate(3.5)
    rig.sync.flush(int(4.0 * rig.freq))         # thrown away, as the mcu does
    rig.store.take()
    sc.reset(int(5.0 * rig.freq))
    sc.set_last_position(int(5.0 * rig.freq), halted)
    rig.tq.set_position(5.0, 0.0, 0.0, 0.0)
    rig.kinematics[0].set_position(0.0, 0.0, 0.0)
    rig.commands, rig.pieces = [], []
    cruise(rig, 6.0, 5.0, 10.0)
    rig.run(7.0, begin=5.0)
    clocks, _ = run_firmware(rig.commands, int(5.0 * rig.freq))
    assert rig.commands[0][0] == "dir"
    assert abs(clocks[0] / rig.freq - 6.0005) <= 26e-6
    assert len(clocks) == 500 and sc.get_last_position() == halted + 500
    assert sc.find_past_position(trigger) == halted
    assert sc.find_past_position(int(clocks[99])) == halted + 100


def test_new_step_distance_counts_from_where_it_is():
    rig = make_rig(0.01)
    t, _ = cruise(rig, 1.0, 1.0, 10.0)
    rig.run(t + 0.1)
    kin = rig.kinematics[0]
    kin.set_stepcompress(rig.steppers[0], 0.02)
    assert abs(kin.get_commanded_pos() - 1.0) <= 0.005
    cruise(rig, t + 0.5, 1.0, 10.0, 1.0, (1.0, 0.0, 0.0))
    rig.run(t + 1.0, begin=t + 0.1)
    assert len(rig.steps()[0]) == 150


def test_nothing_is_made_twice():
    rig = make_rig(0.01)
    cruise(rig, 1.0, 1.0, 10.0)
    kin = rig.kinematics[0]
    for until in (1.05, 1.05, 1.02, 1.1, 2.0, float("nan"), 2.0):
        kin.generate_steps(until)
        kin.check()
    assert rig.steppers[0].get_last_position() == 100


def test_without_queue_or_compressor():
    kin = LinearKinematics(1.0, 0.0, 0.0)
    kin.generate_steps(1.0)
    assert kin.check_active(2.0) == 0.0
    rig = make_rig()
    rig.kinematics[0].set_trapq(None)
    cruise(rig, 1.0, 1.0, 10.0)
    rig.sync.generate(5.0)
    assert rig.steppers[0].get_last_position() == 0
    with pytest.raises(ValueError, match="step distance"):
        kin.set_stepcompress(None, float("nan"))
