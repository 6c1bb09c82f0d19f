# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of the filament drive, with and without pressure advance."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_moves import journeys, travel
from motion_rig import Rig, make_move

from klippy_ext.kin_extruder import ExtruderKinematics

STEP = 0.01


def make_rig(advance, smooth, **options):
    kin = ExtruderKinematics()
    if advance:
        kin.set_pressure_advance(0.0, advance, smooth)
    return Rig([kin], STEP, advance_flag=1.0, **options)


@settings(max_examples=60, deadline=None)
@given(journeys(reach=1.0, flat=True, max_size=8),
       st.sampled_from([0.0, 0.02, 0.2]), st.sampled_from([0.01, 0.04, 0.2]))
def test_random_extrusion(journey, advance, smooth):
    journey = [(pause, (sign, 1.0, 0.0), profile)
               for (pause, _, profile), sign in zip(journey, [1.0, 1.0, -1.0] * 3,
                                                    strict=False)]
    rig = make_rig(advance, smooth)
    end = travel(rig, journey, 0.5)
    # a lead that jumps at a border without averaging would be no path
    rig.run(end + 0.5, ahead=0.1)
    rig.check(lambda path, t: path.extruder(t, advance, smooth), between=False)


def test_moves_without_flag_are_not_led():
    led, plain = make_rig(0.1, 0.04), make_rig(0.1, 0.04)
    plain.advance_flag = 0.0
    for rig, flag in ((led, 1.0), (plain, 0.0)):
        t, _ = rig.add(1.0, make_move(0.1, 0.3, 0.1, rig.start, (1.0, flag, 0.0), 0.0,
                                      5.0, 50.0))
        rig.run(t + 0.5)
    led.check(lambda path, t: path.extruder(t, 0.1, 0.04))
    plain.check(lambda path, t: path.extruder(t, 0.0001, 0.04), tolerance=2e-4)
    assert np.any(led.steps()[1] < 0) and not np.any(plain.steps()[1] < 0)


def faded(path_of, changes):
    """Position with windows that change: [(time, smooth_time before, after)].

    path_of(smooth_time)(t) is the average over one window alone.
    """
    def exact(t):
        value, offset, until, smooth = path_of(changes[0][1])(t), 0.0, 0.0, 0.0
        for at, before, after in changes:
            kept = offset * max(until - at, 0.0) / smooth if smooth else 0.0
            there = np.array([at])
            offset = kept + (path_of(before)(there) - path_of(after)(there))[0]
            smooth = 0.5 * max(before, after)
            until = at + smooth
            fade = offset * np.clip(until - t, 0.0, None) / smooth
            value = np.where(t < at, value, path_of(after)(t) + fade)
        return value
    return exact


def check_changes(rig, advances, changes):
    """advances: {start of a move: advance}; all pieces have flags of 1."""
    starts = sorted(advances)
    rig.pieces = [(*p[:-1], advances[max(s for s in starts if s <= p[0] + 1e-9)])
                  for p in rig.pieces]

    def exact(path, t):
        return faded(lambda smooth: lambda at: path.extruder(
            at, 1.0 if smooth else 0.0, smooth), changes)(t)
    return rig.check(exact)


def add_four_moves(rig):
    """Forth and back without a rest, at speeds that jump; their starts."""
    t, position, starts = 1.0, rig.start, []
    for way, v in ((1, 4.0), (1, 6.0), (-1, 3.0), (1, 5.0)):
        starts.append(t)
        t, position = rig.add(t, make_move(0.05, 0.2, 0.05, position, (way, 1, 0),
                                           0.5 * v, v, 10.0 * v))
    return [*starts, t]


@pytest.mark.parametrize("ahead", [0.06, 0.2, 5.0])
def test_window_grows_and_shrinks_while_it_moves(ahead):
    rig = make_rig(0.02, 0.04)
    starts = add_four_moves(rig)
    kin = rig.kinematics[0]
    kin.set_pressure_advance(starts[1], 0.05, 0.1)
    kin.set_pressure_advance(starts[3], 0.08, 0.02)
    assert kin.scan_window() == (0.05, 0.05)
    rig.run(starts[-1] + 0.5, ahead=ahead)
    kin.check()
    check_changes(rig, {starts[0]: 0.02, starts[1]: 0.05, starts[3]: 0.08},
                  [(starts[1] - 0.05, 0.04, 0.1), (starts[3] + 0.05, 0.1, 0.02)])


def test_advance_turned_on_and_off_while_it_moves():
    rig = make_rig(0.0, 0.0)
    starts = add_four_moves(rig)
    kin = rig.kinematics[0]
    kin.set_pressure_advance(starts[1], 0.05, 0.04)
    kin.set_pressure_advance(starts[3], 0.0, 0.04)
    rig.run(starts[-1] + 0.5)
    check_changes(rig, {starts[0]: 0.0, starts[1]: 0.05, starts[3]: 0.0},
                  [(starts[1] - 0.02, 0.0, 0.04), (starts[3] + 0.02, 0.04, 0.0)])


def test_advance_changes_with_every_move():
    """As slicers do that choose it for each feature; 100 a second, 20 s ahead."""
    rig = make_rig(0.01, 0.04)
    kin, t, position, advances = rig.kinematics[0], 1.0, rig.start, {0.0: 0.01}
    draw = np.random.default_rng(5)
    for _ in range(400):
        advance = 0.01 + 0.001 * float(draw.integers(0, 50))
        kin.set_pressure_advance(t, advance, 0.04)
        advances[t] = advance
        t, position = rig.add(t, make_move(0.0, 0.01, 0.0, position, (1, 1, 0), 5.0,
                                           5.0, 0.0))
    kin.check()
    rig.run(t + 0.5, ahead=0.05)
    check_changes(rig, advances, [(0.0, 0.04, 0.04)])
    # what is no longer needed makes room: this goes on for ever
    for i in range(2000):
        kin.set_pressure_advance(t + 0.01 * i, 0.01 + 0.001 * (i % 7), 0.04)
        rig.tq.append(t + 0.01 * i, make_move(0.0, 0.01, 0.0, position, (1, 1, 0), 0.0,
                                              0.0, 0.0))
        kin.generate_steps(t + 0.01 * i - 2.0)
        kin.check()


def test_retract_and_unretract_at_speed():
    rig = make_rig(0.05, 0.04)
    t, position = 1.0, rig.start
    for way, flag, v in ((1, 1.0, 5.0), (-1, 0.0, 40.0), (1, 0.0, 40.0), (1, 1.0, 5.0)):
        move = make_move(0.02, 0.05, 0.02, position, (way, flag, 0), 0.0, v, 50.0 * v)
        t, position = rig.add(t + 0.003, move)
        rig.pieces[-3:] = [(*p[:-1], flag) for p in rig.pieces[-3:]]
    rig.run(t + 0.5)
    clocks, directions = rig.check(lambda path, at: path.extruder(at, 0.05, 0.04))
    assert set(directions.tolist()) == {-1, 1}


def test_change_while_moving_comes_gradually():
    rig = make_rig(0.05, 0.04)
    rig.kinematics[0].set_pressure_advance(1.5, 0.1, 0.02)
    t, position = rig.add(1.0, make_move(0.1, 0.4, 0.0, rig.start, (1, 1, 0), 0.0, 5.0,
                                         50.0))
    assert abs(t - 1.5) < 1e-9
    t, position = rig.add(t, make_move(0.0, 0.4, 0.1, position, (1, 1, 0), 5.0, 5.0,
                                       50.0))
    rig.run(t + 0.5)
    clocks, directions = rig.steps()
    total = np.sum(directions) * STEP
    assert abs(total - position[0]) <= 0.5 * STEP + 1e-9
    # 0.25 mm more lead within one window of 0.04 s, never faster than that
    assert np.diff(clocks).min() / rig.freq > STEP / (5.0 + 2.5 * 0.25 / 0.02)


def test_window_and_settings():
    kin = ExtruderKinematics()
    assert kin.scan_window() == (0.0, 0.0)
    kin.set_pressure_advance(0.0, 0.05, 0.04)
    assert kin.scan_window() == (0.02, 0.02)
    kin.set_pressure_advance(5.0, 0.0, 0.04)
    assert kin.scan_window() == (0.02, 0.02)        # still needed up to 5.0
    for bad in ((-1.0, 0.04), (0.05, -0.1), (float("nan"), 0.04)):
        with pytest.raises(ValueError, match="pressure advance"):
            kin.set_pressure_advance(6.0, *bad)


def test_many_settings_keep_the_newest():
    kin = ExtruderKinematics()
    for i in range(100):
        kin.set_pressure_advance(float(i), 0.001 * i, 0.04)
    assert kin.scan_window() == (0.02, 0.02)
    assert kin.is_active_axis("x") and not kin.is_active_axis("y")
    assert kin.calc_position_from_coord(7.0, 1.0, 1.0) == 7.0
