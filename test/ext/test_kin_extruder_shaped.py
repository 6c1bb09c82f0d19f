# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of the filament drive where the head that lays it down is shaped."""

import math
import random

import motion_rig
import numpy as np
import pytest
from arc_moves import ArcMove
from motion_rig import Rig, make_move
from truth import advance, shaping

from klippy.extras.motion import shaper_defs, shaper_kernels
from klippy_ext.kin_extruder import ExtruderKinematics
from klippy_ext.shaper import ShapedPath
from klippy_ext.trapq import TrapQ

STEP, RATIO = 0.008, 0.05
FREQS, DAMPING = (45., 52., 33.), 0.1


def make_path(names):
    path = ShapedPath()
    for axis, name in enumerate(names):
        if name in shaper_defs.FAMILIES:
            path.set_impulses(axis, *shaper_defs.make_shaper(
                name, FREQS[axis], DAMPING))
        elif name:
            path.set_kernel(axis, *shaper_kernels.make_kernel(
                name, FREQS[axis], DAMPING))
    return path


def make_rig(names, model=None):
    """A Rig of the filament; its head moves by rig.head."""
    kin = ExtruderKinematics()
    if model:
        kin.set_pressure_advance(0., **model)
    rig = Rig([kin], STEP, freq=64e6, advance_flag=1.)
    rig.head, rig.rows, rig.e = TrapQ(), [], 0.
    kin.set_shaper(make_path(names), rig.head)
    return rig


def add_print_move(rig, t, move):
    """A move of the head (x, y, z), and the filament that it lays down."""
    rig.head.append(t, move)
    rig.tq.append(t, make_filament(rig, move))
    rows, end, at = motion_rig.split_move(t, move)
    add_rows(rig, rows)
    return end, at


def make_filament(rig, move):
    return make_move(move.accel_t, move.cruise_t, move.decel_t, (rig.e, 0., 0.),
                     (1., 1., 0.), RATIO * move.start_v, RATIO * move.cruise_v,
                     RATIO * move.accel)


def add_rows(rig, rows):
    for row in rows:
        way = row[1] * (row[2] + 0.5 * row[3] * row[1])
        rig.rows.append((*row[:10], rig.e, RATIO, 1., *row[13:]))
        rig.e += RATIO * way


def add_print_arc(rig, t, arc):
    """The same along an ArcMove."""
    rig.head.append(t, arc.move)
    rig.tq.append_like(t, make_filament(rig, arc.move), arc.move)
    rows, end, at = arc.split(t)
    add_rows(rig, rows)
    return end, at


def add_filament(rig, t, way, speed):
    """Filament only, at an even speed."""
    sign = math.copysign(1., way)
    duration = abs(way) / speed
    rig.tq.append(t, make_move(0., duration, 0., (rig.e, 0., 0.), (sign, 0., 0.), speed,
                               speed, 0.))
    rig.rows.append((t, duration, speed, 0., 0., 0., 0., 0., 0., 0., rig.e, sign, 0.))
    rig.e += way
    return t + duration


def add_walk(rig, n=40, seed=3, is_flat=False):
    """Moves of many lengths and directions, some with filament pushed between."""
    draw, t, at = random.Random(seed), 1., (3., -2., 10.)
    for _ in range(n):
        way, top = draw.choice([.02, .3, 2., 20.]), draw.uniform(20., 200.)
        accel = draw.uniform(1000., 8000.)
        top = min(top, .99 * math.sqrt(way * accel))
        angle, rise = draw.uniform(0., 6.28), draw.uniform(-.2, .2) * (not is_flat)
        flat = math.sqrt(1. - rise * rise)
        ratio = flat * math.cos(angle), flat * math.sin(angle), rise
        up = top / accel
        t, at = add_print_move(rig, t, make_move(up, way / top - up, up, at, ratio, 0.,
                                                 top, accel))
        kind = draw.randrange(5)
        if kind == 0:
            t = add_filament(rig, t, -0.513, 20.)
            t = add_filament(rig, t + 0.05, 0.513, 20.)
        elif kind < 3:
            t += draw.choice([0.004, 0.1])
    return t


def check(rig, names, model=None):
    axes = {axis: (name, FREQS[axis], DAMPING) for axis, name in enumerate(names)
            if name}
    rig.pieces = rig.rows
    filament = shaping.ShapedFilament(rig.rows, axes)
    plain = dict(model or {})
    linear = plain.pop("advance", 0.)

    def exact(path, t):
        return advance.position(filament, t, linear, **plain)
    clocks, _ = rig.check(exact, between=False)
    assert len(clocks) > 500
    return clocks


LINEAR = dict(advance=0.04, smooth_time=0.03)
TANH = dict(advance=0.02, smooth_time=0.04, model="tanh", offset=0.1, velocity=3.)
LATER = dict(advance=0.04, smooth_time=0.03, time_offset=-0.02)


@pytest.mark.parametrize("model", [None, LINEAR, TANH, LATER],
                         ids=["plain", "linear", "tanh", "later"])
@pytest.mark.parametrize("names", [
    ("mzv", "ei", None), ("zv", None, "zvd"), ("smooth_mzv", "smooth_ei", None),
    ("3hump_ei", "smooth_zv", None)])
def test_every_step(names, model):
    rig = make_rig(names, model)
    rig.run(add_walk(rig) + .5, ahead=.2)
    rig.kinematics[0].check()
    check(rig, names, model)


def add_arcs(rig, n=14, seed=5):
    """Arcs of many radii in all planes, some with a stop or a line between."""
    draw, t, at = random.Random(seed), 1., (3., -2., 10.)
    for _ in range(n):
        radius = 10. ** draw.uniform(-0.5, 1.6)
        accel = draw.uniform(1000., 8000.)
        top = min(draw.uniform(20., 200.), math.sqrt(accel * radius))
        way = max(radius * draw.uniform(0.3, 7.), 1.1 * top * top / accel)
        up = top / accel
        begin = 0.7 if draw.random() < .3 else 0.
        profile = (up * (1. - begin), way / top, up, begin * top, top, accel)
        arc = ArcMove(profile, at, draw.uniform(-3., 3.), radius,
                      draw.choice([-1., 1.]), draw.choice([0., 0., 0.2]),
                      draw.choice([0, 1, 2, 2, 2]))
        t, at = add_print_arc(rig, t, arc)
        kind = draw.randrange(4)
        if kind == 0:
            t = add_filament(rig, t, -0.513, 20.)
            t = add_filament(rig, t + 0.05, 0.513, 20.)
        elif kind == 1:
            t, at = add_print_move(rig, t, make_move(
                0., .05, 0., at, (0.6, -0.8, 0.), 50., 50., 1000.))
    return t


@pytest.mark.parametrize("names, model", [
    (("mzv", "ei", None), LINEAR), (("zv", None, "zvd"), TANH),
    (("smooth_mzv", "smooth_ei", None), LATER), (("mzv", "mzv", None), LINEAR),
    (("3hump_ei", "smooth_zv", None), None)])
def test_every_step_of_arcs(names, model):
    rig = make_rig(names, model)
    rig.run(add_arcs(rig) + .5, ahead=.2)
    rig.kinematics[0].check()
    check(rig, names, model)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_every_step_of_many_arcs(seed):
    draw = random.Random(seed)
    names = [draw.choice([*shaping.NAMES, None]) for _ in range(3)]
    model = draw.choice([None, LINEAR, TANH, LATER])
    rig = make_rig(names, model)
    rig.run(add_arcs(rig, 40, seed) + .5, ahead=.2)
    check(rig, names, model)


@pytest.mark.slow
def test_a_share_that_stays_is_seen():
    """The judge tells filament of arcs that is split as at their starts."""
    names = ("mzv", None, None)
    rig = make_rig(names, LINEAR)
    rig.run(add_arcs(rig, 3) + .5, ahead=.2)
    rig.rows = [row[:13] for row in rig.rows]
    with pytest.raises(AssertionError):
        check(rig, names, LINEAR)


@pytest.mark.parametrize("name", shaping.NAMES)
def test_every_shaper(name):
    rig = make_rig((name, name, None), LINEAR)
    rig.run(add_walk(rig, 20, is_flat=True) + .5, ahead=.2)
    check(rig, (name, name, None), LINEAR)


def add_curve(rig, n=400):
    """Segments of 0.3 mm along an arc at 100 mm/s, sped up and slowed down."""
    t, at, angle, v = 1., (0., 0., 0.), 0., 10.
    for i in range(n):
        angle += 0.03
        end_v = min(100., math.sqrt(v * v + 2. * 3000. * .3)) if i < n // 2 else max(
            10., math.sqrt(max(v * v - 2. * 3000. * .3, 100.)))
        up, down = max(end_v - v, 0.) / 3000., max(v - end_v, 0.) / 3000.
        mean = .5 * (v + end_v)
        rest = max(.3 / mean - up - down, 0.)
        cruise = max(v, end_v)
        t, at = add_print_move(rig, t, make_move(
            up, rest, down, at, (math.cos(angle), math.sin(angle), 0.), v, cruise,
            3000.))
        v = end_v
    return t


@pytest.mark.parametrize("names", [("mzv", "ei", None), ("smooth_mzv", "zv", None)])
def test_dense_path(names):
    rig = make_rig(names, LINEAR)
    rig.run(add_curve(rig) + .5, ahead=.2)
    check(rig, names, LINEAR)


def test_shares_add_up():
    """A move along x only is all x's, and what is pushed at rest is nobody's."""
    rig, plain = make_rig(("mzv", "ei", None)), make_rig((None, None, None))
    for each in (rig, plain):
        t = add_filament(each, 1., 2., 20.)
        each.run(t + .5, ahead=.2)
    assert np.array_equal(rig.steps()[0], plain.steps()[0])
    same, other = make_rig(("mzv", "ei", None)), make_rig(("mzv", "mzv", None))
    for each in (same, other):
        move = make_move(.02, .2, .02, (0., 0., 0.), (1., 0., 0.), 0., 100., 5000.)
        t, _ = add_print_move(each, 1., move)
        each.run(t + .5, ahead=.2)
    assert np.array_equal(same.steps()[0], other.steps()[0])


def test_steps_do_not_depend_on_slices():
    clocks = []
    for period in (.25, .0137):
        rig = make_rig(("mzv", "smooth_ei", None), LINEAR)
        rig.run(add_walk(rig, 25) + .5, period, ahead=.2)
        clocks.append(rig.steps())
    assert np.array_equal(clocks[0][1], clocks[1][1])
    assert np.abs(clocks[0][0] - clocks[1][0]).max() < 2 * 25e-6 * 64e6


def test_window():
    kin = ExtruderKinematics()
    kin.set_pressure_advance(0., 0.05, 0.04)
    path = make_path(("mzv", "smooth_ei", None))
    pre, post = path.scan_window()
    kin.set_shaper(path, TrapQ())
    assert kin.scan_window() == pytest.approx((pre + 0.02, post + 0.02))
    assert kin.get_shaper_window() == (pre, post)
    kin.check()
    kin.set_shaper(None)
    assert kin.scan_window() == (0.02, 0.02)
    with pytest.raises(ValueError, match="moves of x, y and z"):
        kin.set_shaper(path)
