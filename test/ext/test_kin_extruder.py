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


def test_advance_from_a_time_on():
    rig = make_rig(0.05, 0.04)
    rig.kinematics[0].set_pressure_advance(3.0, 0.0, 0.04)
    t, position = rig.add(1.0, make_move(0.1, 0.3, 0.1, rig.start, (1, 1, 0), 0.0, 5.0,
                                         50.0))
    split = t + 0.5
    assert split < 3.0
    t, position = rig.add(3.0, make_move(0.1, 0.3, 0.1, position, (1, 1, 0), 0.0, 5.0,
                                         50.0))
    rig.run(t + 0.5)

    def exact(path, times):
        return np.where(times < 2.9, path.extruder(np.minimum(times, 2.9), 0.05, 0.04),
                        path.extruder(times))
    # the old window still serves while it holds moves of the old setting: the
    # first step at 25 mm/s^2 is 2.6 ms early by that
    rig.check(exact, tolerance=3e-3)
    clocks, directions = rig.steps()
    after = clocks / rig.freq > 3.05
    assert np.all(directions[after] > 0)


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
