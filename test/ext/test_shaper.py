# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps along shaped paths against the slow model, and what is refused."""

import math
import random

import motion_rig
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_moves import journeys, travel
from motion_rig import Rig, make_move
from truth import machines, polar, shaping

from klippy.extras.motion import shaper_defs, shaper_kernels
from klippy_ext.kin_delta import DeltaKinematics
from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.kin_polar import PolarBedKinematics
from klippy_ext.shaper import ShapedPath
from klippy_ext.trapq import TrapQ

FREQ, DAMPING = 45., 0.1
TOWER = (130. * math.cos(0.4), 130. * math.sin(0.4))
KINDS = {
    "x": (lambda: LinearKinematics(1., 0., 0.), lambda p: p[:, 0]),
    "corexy": (lambda: LinearKinematics(1., -1., 0.), lambda p: p[:, 0] - p[:, 1]),
    "odd": (lambda: LinearKinematics(.5, 0., -2.),
            lambda p: .5 * p[:, 0] - 2 * p[:, 2]),
    "delta": (lambda: DeltaKinematics(250. ** 2, *TOWER),
              machines.delta_carriage(250., *TOWER)),
}


def make_path(names, freq=FREQ, damping=DAMPING):
    """A ShapedPath of the program; names by axis, None for none."""
    path = ShapedPath()
    for axis, name in enumerate(names):
        if name in shaper_defs.FAMILIES:
            path.set_impulses(axis, *shaper_defs.make_shaper(
                name, freq + 7. * axis, damping))
        elif name:
            path.set_kernel(axis, *shaper_kernels.make_kernel(
                name, freq + 7. * axis, damping))
    return path


def make_model(names):
    return {axis: (name, FREQ + 7. * axis, DAMPING)
            for axis, name in enumerate(names) if name}


def make_rig(kind, names, path=None):
    kin = KINDS[kind][0]()
    rig = Rig([kin], 1 / 160, freq=64e6, start=(3., -2., 10.))
    kin.set_shaper(path or make_path(names))
    return rig


def add_walk(rig, n=60, seed=3):
    """Moves of many lengths, some with rests in between."""
    draw, t, at = random.Random(seed), 1., rig.start
    for _ in range(n):
        way, top = draw.choice([.02, .3, 2., 20.]), draw.uniform(20., 200.)
        accel = draw.uniform(1000., 8000.)
        top = min(top, .99 * math.sqrt(way * accel))
        angle, rise = draw.uniform(0., 6.28), draw.uniform(-.2, .2)
        flat = math.sqrt(1. - rise * rise)
        ratio = flat * math.cos(angle), flat * math.sin(angle), rise
        speed_up = top / accel
        t, at = rig.add(t, make_move(speed_up, way / top - speed_up, speed_up, at,
                                     ratio, 0., top, accel))
        t += draw.choice([0., 0., 0.004, 0.1])
    return t


def check(rig, kind, names, position=None):
    model, old = make_model(names), motion_rig.Path
    motion_rig.Path = lambda pieces: shaping.ShapedPath(pieces, model)
    try:
        function = position or KINDS[kind][1]
        return rig.check(lambda path, t: function(path.xyz(t)))
    finally:
        motion_rig.Path = old


@pytest.mark.parametrize("name", shaping.NAMES)
@pytest.mark.parametrize("kind", ["x", "corexy", "delta"])
def test_every_step(kind, name):
    names = (name, "mzv" if name != "mzv" else "ei", None)
    rig = make_rig(kind, names)
    end = add_walk(rig)
    rig.run(end + .5)
    clocks, _ = check(rig, kind, names)
    assert len(clocks) > 10000


@pytest.mark.parametrize("name", ["mzv", "3hump_ei", "smooth_ei"])
@pytest.mark.parametrize("length", [.01, .5])
def test_ways_in_many_parts(name, length):
    """More borders than the path remembers, at most of which nothing jumps."""
    names = (name, None, None)
    rig = make_rig("corexy", names)
    t, at = 1., rig.start
    for i in range(6):
        ratio = (.8, .6, 0.) if i % 2 else (-.6, .8, 0.)
        t, at = rig.add(t, make_move(.02, 0., 0., at, ratio, 0., 100., 5000.))
        for _ in range(300 if length < .1 else 20):
            t, at = rig.add(t, make_move(0., length / 100., 0., at, ratio, 100.,
                                         100., 5000.))
        t, at = rig.add(t, make_move(0., 0., .02, at, ratio, 100., 100., 5000.))
    rig.run(t + .5)
    clocks, _ = check(rig, "corexy", names)
    assert len(clocks) > 3000


@settings(max_examples=30, deadline=None)
@given(journeys(reach=2.0, max_size=8), st.sampled_from(list(KINDS)),
       st.sampled_from(shaping.NAMES), st.sampled_from(shaping.NAMES))
def test_random_journeys(journey, kind, name_x, name_y):
    """Speeds that jump, long and short rests, everything within one window."""
    names = (name_x, name_y, None)
    rig = make_rig(kind, names)
    rig.run(travel(rig, journey, 1.) + .5)
    check(rig, kind, names)
    rig.kinematics[0].check()


@pytest.mark.parametrize("name", shaping.NAMES)
def test_position_is_the_average(name):
    names = (name, None, name)
    path, rig = make_path(names), Rig([], 1., start=(3., -2., 10.))
    end = add_walk(rig, 20)
    at = np.linspace(.9, end + .1, 400)
    found = np.array([path.get_position(rig.tq, t) for t in at])
    exact = shaping.ShapedPath(rig.pieces, make_model(names)).xyz(at)
    # kernels are designed by two ways of integration
    assert np.abs(found - exact).max() < (5e-9 if "smooth" in name else 1e-12)
    path.check()


@pytest.mark.parametrize("names", [("mzv", "ei", None), ("smooth_ei", "zv", None)])
def test_a_bed_that_turns(names):
    kin = PolarBedKinematics()
    rig = Rig([kin], 1e-4, freq=64e6, start=(-70., 0., 10.))
    kin.set_shaper(make_path(names))
    rig.run(add_walk(rig, 30) + .5)

    def turn(p):        # counted from where it starts, which is at pi
        return np.pi + np.arctan2(-p[:, 1], -p[:, 0])
    clocks, _ = check(rig, "bed", names, turn)
    assert len(clocks) > 1000


CENTRE_WAYS = {
    "straight": [(-3., 0.), (3., 0.), (-2., 0.)],
    "aslant": [(-2., -1.), (2., 1.), (-1., 2.)],
    "beside": [(-2., 0.004), (2., 0.004), (2., -.02), (-2., -.02)],
    "rest": [(-2., 0.), (0., 0.), (1., 1.5), (0., 0.), (-1., 1.)],
    "corner": [(-2., -.5), (.003, .002), (-.5, 2.)],
}


def add_polar_way(rig, points, bed_speed=20.):
    """Moves whose parts are as slow as a bed that turns at bed_speed needs them."""
    t, at = 1., (*points[0], 10.)
    for end in points[1:]:
        end = (*end, 10.)
        radii = [polar.CORE * 2 ** k for k in range(12)]
        shares = sorted(s for r in radii for s in polar.crossings(at, end, r))
        stops = [at, *(polar.between(at, end, s) for s in shares), end]
        for a, b in zip(stops, stops[1:], strict=False):
            way = math.dist(a, b)
            if way < 1e-9:
                continue
            inner = max(polar.span(a, b)[0], 0.5 * polar.CORE)
            speed = min(30., bed_speed * inner)
            ratio = tuple((q - p) / way for p, q in zip(a, b, strict=True))
            t, _ = rig.add(t, make_move(0., way / speed, 0., a, ratio, speed,
                                        speed, 0.))
        at = end
    return t


@pytest.mark.parametrize("names", [
    ("mzv", "mzv", None), ("mzv", "ei", None), ("smooth_ei", "zv", None)])
@pytest.mark.parametrize("way", CENTRE_WAYS)
@pytest.mark.parametrize("period", [.25, .0137])
def test_a_bed_near_its_centre(names, way, period):
    step, points = 1e-3, CENTRE_WAYS[way]
    kin = PolarBedKinematics()
    rig = Rig([kin], step, freq=64e6, start=(*points[0], 10.))
    kin.set_shaper(make_path(names))
    origin = kin.calc_position_from_coord(*rig.start)
    rig.run(add_polar_way(rig, points) + .5, period)
    clocks, directions = rig.steps()
    path = shaping.ShapedPath(rig.pieces, make_model(names))
    judge = polar.BedJudge(path, step, 1. / rig.freq, 4. * np.pi * 20.)
    assert judge.check(clocks / rig.freq, directions, 0, origin) >= 1
    assert len(clocks) > 1000


def test_z_and_two_kernels():
    names = ("smooth_mzv", None, "smooth_ei")
    rig = make_rig("odd", names)
    rig.run(add_walk(rig) + .5)
    check(rig, "odd", names)


@pytest.mark.parametrize("names", [("mzv", "ei", None), ("smooth_ei", "zv", None)])
def test_steps_do_not_depend_on_slices(names):
    clocks = []
    for period in (.25, .0137):
        rig = make_rig("corexy", names)
        rig.run(add_walk(rig, 25) + .5, period)
        clocks.append(rig.steps())
    assert np.array_equal(clocks[0][1], clocks[1][1])
    assert np.abs(clocks[0][0] - clocks[1][0]).max() < 2 * 25e-6 * 64e6


def test_the_window_is_that_of_the_path():
    path = make_path(("3hump_ei", "smooth_si", None))
    kin = LinearKinematics(1., 0., 0.)
    kin.set_shaper(path)
    assert kin.scan_window() == path.scan_window()
    assert min(path.scan_window()) > 0.5 * 1.6 / 52.01
    kin.check()
    kin.set_shaper(None)
    assert kin.scan_window() == (0., 0.)


def test_motors_are_wanted_before_the_move():
    rig = make_rig("x", ("mzv", None, None))
    add_walk(rig, 2)
    post = rig.kinematics[0].shaper.scan_window()[1]
    assert rig.kinematics[0].check_active(2.) == pytest.approx(1. - post)
    assert rig.kinematics[0].check_active(1. - post - 1e-6) == 0.


def test_another_position_does_not_move():
    rig = make_rig("x", ("ei", None, None))
    end = add_walk(rig, 5)
    rig.run(end + .1)
    n = len(rig.steps()[0])
    rig.tq.set_position(end, 100., 50., 10.)
    rig.kinematics[0].set_position(100., 50., 10.)
    rig.run(end + .2, begin=end + .1)
    assert len(rig.steps()[0]) == n


def test_one_path_a_stepper():
    path = make_path(("zv", None, None))
    LinearKinematics(1., 0., 0.).set_shaper(path)
    with pytest.raises(ValueError):
        LinearKinematics(1., 0., 0.).set_shaper(path)
    with pytest.raises(RuntimeError):
        path.set_impulses(0, [1.], [0.])


@pytest.mark.parametrize("weights, delays", [
    ([], []), ([.5, .4], [0., 1.]), ([1.], [math.nan]), ([math.nan], [0.]),
    ([.5, .5], [0.]), ([.1] * 10, [0.] * 10)])
def test_no_average(weights, delays):
    with pytest.raises(ValueError):
        ShapedPath().set_impulses(0, weights, delays)


@pytest.mark.parametrize("coeffs, half", [
    ([], 1.), ([.4], 1.), ([.5], 0.), ([.5], math.inf), ([.5] + [0.] * 16, 1.)])
def test_no_kernel(coeffs, half):
    with pytest.raises(ValueError):
        ShapedPath().set_kernel(1, coeffs, half)


def test_position():
    queue = TrapQ()
    path = make_path(("zv", None, None), damping=0.)
    with pytest.raises(ValueError):
        path.get_position(queue, 0.)
    queue.append(1., make_move(0., 1., 0., (0., 0., 0.), (1., 0., 0.), 10., 10., 0.))
    assert path.get_position(queue, 1.5) == pytest.approx((5., 0., 0.))
    assert path.get_position(queue, 1.)[0] == pytest.approx(10. * .25 / FREQ / 2.)
    path.check()
