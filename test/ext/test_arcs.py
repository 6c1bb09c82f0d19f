# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps along arcs, of every kind of kinematics, against exact paths."""

import math

import numpy as np
import pytest
from arc_moves import ArcMove, add_arc, tour, tours
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from motion_rig import Path, Rig, make_move
from truth import curves

from klippy_ext.kin_delta import DeltaKinematics
from klippy_ext.kin_deltesian import DeltesianKinematics
from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.kin_polar import PolarBedKinematics
from klippy_ext.kin_rotary_delta import RotaryDeltaKinematics
from klippy_ext.kin_winch import RadiusKinematics, WinchKinematics
from klippy_ext.trapq import TrapQ

ARM = 250.0
TOWERS = [(130.0 * math.cos(a), 130.0 * math.sin(a))
          for a in (math.radians(d) for d in (210.0, 330.0, 90.0))]
WEIGHTS = [(1., 0., 0.), (0., 1., 0.), (0., 0., 1.), (1., 1., 0.), (1., -1., 0.),
           (1., 0., -1.), (0.5, -0.3, 2.)]
QUIET = dict(deadline=None, suppress_health_check=[HealthCheck.too_slow])


def make_delta():
    return [DeltaKinematics(ARM ** 2, x, y) for x, y in TOWERS]


def get_height(tower):
    def height(path, t):
        xyz = path.xyz(t)
        flat2 = (tower[0] - xyz[:, 0]) ** 2 + (tower[1] - xyz[:, 1]) ** 2
        return xyz[:, 2] + np.sqrt(ARM ** 2 - flat2)
    return height


def get_sum(weights):
    return lambda path, t: path.xyz(t) @ np.array(weights)


def check_linear(steps, freq):
    rig = Rig([LinearKinematics(*w) for w in WEIGHTS], 0.01, freq=freq)
    rig.run(tour(rig, steps, 0.3) + 0.1)
    for oid, weights in enumerate(WEIGHTS):
        rig.check(get_sum(weights), oid)


def check_delta(steps, freq, start=(0., 0., 0.)):
    rig = Rig(make_delta(), 0.01, freq=freq, start=start)
    rig.run(tour(rig, steps, 0.3) + 0.1)
    for oid, tower in enumerate(TOWERS):
        rig.check(get_height(tower), oid)


frequencies = st.sampled_from([16e6, 180e6])
places = st.tuples(*[st.floats(-40.0, 40.0)] * 3)


@settings(max_examples=100, **QUIET)
@given(tours(), frequencies)
def test_random_arcs_on_linear_machines(steps, freq):
    check_linear(steps, freq)


@settings(max_examples=100, **QUIET)
@given(tours(), frequencies, places)
def test_random_arcs_on_a_delta(steps, freq, start):
    check_delta(steps, freq, start)


@pytest.mark.slow
@settings(max_examples=20000, **QUIET)
@given(tours(), frequencies)
def test_many_arcs_on_linear_machines(steps, freq):
    check_linear(steps, freq)


@pytest.mark.slow
@settings(max_examples=20000, **QUIET)
@given(tours(), frequencies, places)
def test_many_arcs_on_a_delta(steps, freq, start):
    check_delta(steps, freq, start)


def make_circle(position, radius=20., speed=100., rise=0., turns=1., normal=2):
    """Speeding up and down, a whole number of turns."""
    accel = 3000.
    ramp = speed / accel
    way = turns * 2. * math.pi * radius * math.hypot(1., rise)
    profile = (ramp, way / speed - ramp, ramp, 0., speed, accel)
    return ArcMove(profile, position, 0.7, radius, 1., rise, normal)


def rotary(p):
    return curves.rotary_arm(40., 300., 1., 120., 260.)(p)


OTHERS = {
    "deltesian": (lambda: DeltesianKinematics(ARM ** 2, -130.), 0.01,
                  lambda p: p[:, 2] + np.sqrt(ARM ** 2 - (p[:, 0] + 130.) ** 2)),
    "rotary_delta": (lambda: RotaryDeltaKinematics(40., 300., 1., 120., 260.),
                     0.0001, rotary),
    "winch": (lambda: WinchKinematics(50., -800., 900.), 0.01,
              lambda p: np.sqrt((p[:, 0] - 50.) ** 2 + (p[:, 1] + 800.) ** 2
                                + (p[:, 2] - 900.) ** 2)),
    "arm": (RadiusKinematics, 0.01, lambda p: np.hypot(p[:, 0], p[:, 1])),
    "bed": (PolarBedKinematics, 0.0001,
            lambda p: np.unwrap(np.arctan2(p[:, 1], p[:, 0]), period=2. * np.pi)),
}


@pytest.mark.parametrize("normal", [0, 1, 2])
@pytest.mark.parametrize("rise", [0., 0.1])
@pytest.mark.parametrize("kind", OTHERS)
def test_circles_on_other_machines(kind, rise, normal):
    make, step_dist, position = OTHERS[kind]
    start = (60., 3., 5.)
    rig = Rig([make()], step_dist, start=start)
    end, _ = add_arc(rig, 1., make_circle(start, rise=rise, normal=normal))
    rig.run(end + 0.1)

    def exact(path, t):
        order = np.argsort(t)
        values = np.empty(len(t))
        values[order] = position(path.xyz(np.asarray(t)[order]))
        return values
    assert len(rig.check(exact)[0]) > 100


def test_steps_do_not_depend_on_slices():
    found = []
    for period in (0.25, 0.0137):
        rig = Rig([LinearKinematics(1., 0., 0.), *make_delta()], 0.01)
        end, _ = add_arc(rig, 1., make_circle((0., 0., 0.)))
        rig.run(end + 0.1, flush_period=period)
        found.append([rig.steps(oid) for oid in range(4)])
    for one, other in zip(*found, strict=True):
        assert np.array_equal(one[1], other[1])
        assert np.abs(one[0] - other[0]).max() <= 2 * 25e-6 * 16e6 + 1


def test_circle_closes_and_turns_twice():
    rig = Rig([LinearKinematics(1., 0., 0.)], 0.01)
    end, position = add_arc(rig, 1., make_circle((0., 0., 0.), turns=1.))
    assert position == pytest.approx((0., 0., 0.), abs=1e-9)
    rig.run(end + 0.1)
    _, directions = rig.check(get_sum((1., 0., 0.)))
    assert abs(directions.sum()) <= 1
    assert np.count_nonzero(np.diff(directions)) == 2


def test_line_tangent_arc_line():
    """The planner's order of things: corners without a stop."""
    rig = Rig([LinearKinematics(1., 1., 0.), LinearKinematics(1., -1., 0.)], 0.01)
    t, position = rig.add(1., make_move(0.1, 0.1, 0., (0., 0., 0.), (1., 0., 0.), 0.,
                                        100., 1000.))
    quarter = 0.5 * math.pi * 5. / 100.
    t, position = add_arc(rig, t, ArcMove((0., quarter, 0., 100., 100., 1000.),
                                          position, 0., 5., 1., 0., 2))
    t, position = rig.add(t, make_move(0., 0.1, 0.1, position, (0., 1., 0.), 100.,
                                       100., 1000.))
    rig.run(t + 0.1)
    for oid, weights in enumerate(((1., 1., 0.), (1., -1., 0.))):
        rig.check(get_sum(weights), oid)


@settings(max_examples=40, **QUIET)
@given(tours(reach=50.), st.integers(1, 40))
def test_extracted_chords_are_close_and_continuous(steps, page):
    rig = Rig([LinearKinematics(1., 0., 0.)], 0.01)
    end = tour(rig, steps, 1.)
    path = Path(rig.pieces)
    rows, until = [], end + 1.
    while True:
        more = rig.tq.extract_old(page, 0., until)
        rows += more
        if len(more) < page:
            break
        until = more[-1][0]
    assert len(rows) >= sum(1 for p in rig.pieces if p[2] or p[3])
    for t, duration, v, accel, *where in rows:
        for at in (0., 0.3 * duration, duration):
            way = (v + 0.5 * accel * at) * at
            told = np.array(where[:3]) + np.array(where[3:]) * way
            exact = path.xyz(np.array([t + at]))[0]
            assert np.linalg.norm(told - exact) < 0.02


@pytest.mark.parametrize("name, value", [("turn", math.nan), ("turn", math.inf),
                                         ("normal", 3), ("normal", -1)])
def test_senseless_arcs_are_refused(name, value):
    queue, arc = TrapQ(), make_circle((0., 0., 0.))
    setattr(arc.move, name, value)
    with pytest.raises(ValueError, match="normal"):
        queue.append(1., arc.move)
    assert queue.extract_old(10, 0., 100.) == []
