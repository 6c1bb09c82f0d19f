# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of the filament drive with curved pressure advance and time offset."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_moves import journeys, travel
from motion_rig import Rig, make_move
from truth import advance
from truth.path import Path

from klippy_ext.kin_extruder import ExtruderKinematics

STEP = 0.01
SMOOTH = 0.04


def make_rig(linear, smooth=SMOOTH, **model):
    kin = ExtruderKinematics()
    kin.set_pressure_advance(0.0, linear, smooth, **model)
    return Rig([kin], STEP, advance_flag=1.0)


def make_exact(linear, smooth=SMOOTH, **model):
    return lambda path, t: advance.position(path, t, linear, smooth, **model)


@settings(max_examples=40, deadline=None)
@given(journeys(reach=1.0, flat=True, max_size=6), st.sampled_from(["tanh", "recipr"]),
       st.sampled_from([0.0, 0.03]), st.sampled_from([0.02, 0.3]),
       st.sampled_from([0.5, 8.0]), st.sampled_from([0.01, 0.04, 0.2]),
       st.sampled_from([-0.03, 0.0, 0.05]))
def test_random_extrusion(journey, kind, linear, offset, velocity, smooth, ahead):
    journey = [(pause, (1.0, 1.0, 0.0), profile) for pause, _, profile in journey]
    model = dict(model=kind, offset=offset, velocity=velocity, time_offset=ahead)
    rig = make_rig(linear, smooth, **model)
    end = travel(rig, journey, 0.5)
    rig.run(end + 0.5, ahead=0.2)
    rig.kinematics[0].check()
    rig.check(make_exact(linear, smooth, **model), between=False)


@pytest.mark.parametrize("ahead", [-0.1, -0.01, 0.02, 0.1])
@pytest.mark.parametrize("linear, smooth", [(0.0, 0.0), (0.05, 0.04)])
def test_time_offset(ahead, linear, smooth):
    rig, plain = make_rig(linear, smooth, time_offset=ahead), make_rig(linear, smooth)
    for each in (rig, plain):
        t, position = each.add(1.0, make_move(0.1, 0.3, 0.1, each.start, (1, 1, 0), 0.0,
                                              5.0, 50.0))
        t, _ = each.add(t + 0.2, make_move(0.1, 0.3, 0.1, position, (-1, 0, 0), 0.0,
                                           5.0, 50.0))
        each.pieces[-3:] = [(*piece[:-1], 0.0) for piece in each.pieces[-3:]]
        each.run(t + 0.5, ahead=0.2)
    clocks, directions = rig.check(make_exact(linear, smooth, time_offset=ahead))
    at, along = plain.steps()
    assert np.array_equal(directions, along)
    # all the same, but earlier
    assert np.max(np.abs(at - clocks - ahead * rig.freq)) <= 2 * 25e-6 * rig.freq
    half = 0.5 * smooth * bool(linear)
    assert rig.kinematics[0].scan_window() == (half + max(-ahead, 0.0),
                                               half + max(ahead, 0.0))


def cruise(rig, t, position, speed, duration):
    return rig.add(t, make_move(0.0, duration, 0.0, position, (1, 1, 0), speed, speed,
                                0.0))


@pytest.mark.parametrize("kind, share", [("tanh", np.tanh(2.0)), ("recipr", 2.0 / 3.0)])
def test_lead_at_a_steady_speed(kind, share):
    """Mid-way there is the plain sum of both parts; at rest nothing."""
    rig = make_rig(0.02, model=kind, offset=0.4, velocity=3.0)
    t, position = rig.add(1.0, make_move(0.1, 1.0, 0.1, rig.start, (1, 1, 0), 0.0, 6.0,
                                         60.0))
    rig.run(t + 0.5)
    clocks, directions = rig.check(make_exact(0.02, model=kind, offset=0.4,
                                              velocity=3.0))
    count = int(np.sum(directions[clocks <= 1.6 * rig.freq]))
    nominal = 0.5 * 60.0 * 0.1 ** 2 + 6.0 * 0.5
    assert abs(count * STEP - nominal - 0.02 * 6.0 - 0.4 * share) <= 0.51 * STEP
    assert abs(int(np.sum(directions)) * STEP - position[0]) <= 0.51 * STEP


@pytest.mark.parametrize("first, second", [
    (dict(), dict(model="tanh", offset=0.2, velocity=4.0)),
    (dict(model="tanh", offset=0.2, velocity=4.0),
     dict(model="recipr", offset=0.1, velocity=2.0)),
    (dict(), dict(time_offset=0.02)), (dict(time_offset=0.02), dict(time_offset=-.01)),
    (dict(model="recipr", offset=0.3, velocity=9.0, time_offset=0.01), dict())])
def test_changes_while_it_moves_fade(first, second):
    """No jump where it changes, right again one window later, for ever."""
    rig = make_rig(0.02, **first)
    kin = rig.kinematics[0]
    t, position = cruise(rig, 1.0, rig.start, 5.0, 0.5)
    change = t
    kin.set_pressure_advance(change, 0.02, SMOOTH, **second)
    t, position = cruise(rig, t, position, 5.0, 1.0)
    rig.run(t + 0.5, ahead=0.2)
    kin.check()
    clocks, directions = rig.steps()
    times, counts = clocks / rig.freq, np.cumsum(directions)
    path = Path(rig.pieces)
    for low, high, model in ((1.2, change - 0.1, first), (change + 0.1, t + 0.3,
                                                          second)):
        inside = (times > low) & (times < high)
        exact = make_exact(0.02, **model)(path, times[inside]) / STEP
        assert inside.sum() > 90
        assert np.max(np.abs(exact - counts[inside])) <= 0.52
    # never much faster than the speed and the fading, in 0.02 s at least
    jump = abs(float((make_exact(0.02, **first)(path, np.array([change]))
                      - make_exact(0.02, **second)(path, np.array([change])))[0]))
    near = np.abs(times - change) < 0.1
    gap = np.diff(clocks[near]).min() / rig.freq
    assert gap > STEP / (5.0 + 1.2 * jump / 0.02 + 0.5) - 2 * 25e-6


def test_models_change_with_every_move():
    rig, t, draw = make_rig(0.01), 1.0, np.random.default_rng(7)
    kin, position = rig.kinematics[0], rig.start
    for i in range(300):
        kin.set_pressure_advance(
            t, 0.01, SMOOTH, model=("linear", "tanh", "recipr")[i % 3],
            offset=0.01 * float(draw.integers(0, 5)), velocity=5.0,
            time_offset=0.001 * float(draw.integers(-3, 4)))
        t, position = cruise(rig, t, position, 5.0, 0.02)
        if i % 20 == 19:
            kin.generate_steps(t - 0.1)
            kin.check()
    kin.set_pressure_advance(t, 0.0, 0.0)
    rig.run(t + 0.5)
    assert int(np.sum(rig.steps()[1])) == round(position[0] / STEP)


@pytest.mark.parametrize("model", [
    dict(offset=-0.1), dict(model="tanh", offset=0.1), dict(velocity=-1.0),
    dict(time_offset=float("inf")), dict(model="recipr", offset=0.1, velocity=0.0)])
def test_wrong_models(model):
    kin = ExtruderKinematics()
    with pytest.raises(ValueError, match="pressure advance"):
        kin.set_pressure_advance(1.0, 0.01, SMOOTH, **model)
    with pytest.raises(KeyError):
        kin.set_pressure_advance(1.0, 0.01, SMOOTH, model="cubic")
    assert kin.scan_window() == (0.0, 0.0)
