# SPDX-License-Identifier: GPL-3.0-or-later
"""What arcs are allowed: all of them counts, not only their ends."""

import math

import motion_bench
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machine_configs import BED, make_axes, make_curved, make_delta

from klippy.arcpath import ArcPath
from klippy.errors import CommandError
from klippy.lookahead import LookAheadQueue, MotionLimits, Move, make_arc_move

LIMITS = MotionLimits(300., 3000., 0.5, 5.)


def make_arc(center=(100., 100.), radius=20., first=0., sweep=1., z=(10., 10.)):
    """Around a vertical axis."""
    points = [(center[0] + radius * math.cos(a), center[1] + radius * math.sin(a), h)
              for a, h in zip((first, first + sweep), z, strict=True)]
    return ArcPath(*points, center, sweep, 2)


def sample(arc, count=2001):
    return np.array([arc.find_point(i / (count - 1)) for i in range(count)])


shapes = st.tuples(st.floats(0.01, 100.), st.floats(-7., 7.),
                   st.floats(0.01, 2. * math.pi), st.sampled_from([-1., 1.]),
                   st.floats(-20., 20.), st.integers(0, 2))


@settings(max_examples=200, deadline=None)
@given(shapes, st.floats(-50., 50.), st.floats(-50., 50.))
def test_geometry_against_samples(shape, to_a, to_b):
    radius, first, sweep, sign, rise, normal = shape
    points = []
    for angle, height in ((first, 0.), (first + sign * sweep, rise)):
        point = [height] * 3
        point[(normal + 1) % 3] = 3. + radius * math.cos(angle)
        point[(normal + 2) % 3] = -4. + radius * math.sin(angle)
        points.append(point)
    arc = ArcPath(*points, (3., -4.), sign * sweep, normal)
    dots = sample(arc)
    assert np.allclose(dots[[0, -1]], points, atol=1e-9 * (1. + radius))
    steps = np.diff(dots, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    assert lengths.sum() == pytest.approx(arc.length, rel=1e-5)
    slack = 1e-5 * (radius + abs(rise))
    for (low, high), values in zip(arc.find_box(), dots.T, strict=True):
        assert low <= values.min() + 1e-9 and values.min() - low < slack
        assert high >= values.max() - 1e-9 and high - values.max() < slack
    for share, row in ((0., 0), (1., -1)):
        assert np.allclose(arc.find_direction(share), steps[row] / lengths[row],
                           atol=0.01)
    away = np.hypot(dots[:, (normal + 1) % 3] - to_a, dots[:, (normal + 2) % 3] - to_b)
    near, far = arc.find_nearest(to_a, to_b)
    assert near <= away.min() + 1e-9 and away.min() - near < 2e-3 * radius
    assert far >= away.max() - 1e-9 and far - away.max() < slack
    for axis in range(3):
        slopes = np.abs(steps[:, axis]) / lengths
        assert arc.find_steepest(axis) == pytest.approx(slopes.max(), abs=2e-3)


def test_accel_towards_the_middle_limits_the_speed():
    for radius in (0.01, 1., 20., 1000.):
        move = make_arc_move(LIMITS, make_arc(radius=radius), 0., 0., 300.)
        assert move.max_cruise_v2 == pytest.approx(min(3000. * radius, 300. ** 2))
        move.limit_speed(1000., 500.)
        assert move.max_cruise_v2 == pytest.approx(min(500. * radius, 300. ** 2))
    # a helix is less bent
    move = make_arc_move(LIMITS, make_arc(radius=1., z=(0., 1.)), 0., 0., 300.)
    assert move.max_cruise_v2 == pytest.approx(3000. * 2.)
    assert move.move_d == pytest.approx(math.sqrt(2.))


def test_tangents_count_at_junctions():
    arc = make_arc(radius=20., sweep=0.5 * math.pi)     # from (120, 100) to (100, 120)
    into = Move(LIMITS, (120., 50., 10., 0.), (120., 100., 10., 0.), 100.)
    on = make_arc_move(LIMITS, arc, 0., 1., 100.)
    out = Move(LIMITS, (100., 120., 10., 1.), (50., 120., 10., 1.), 100.)
    back = Move(LIMITS, (100., 120., 10., 1.), (150., 120., 10., 1.), 100.)
    queue = LookAheadQueue()
    queue.add_move(into)
    for prev, move in ((into, on), (on, out)):
        move.calc_junction(prev, 1e9)
        queue.add_move(move)
    planned = queue.take(True)
    assert planned[1].start_v == planned[1].cruise_v == pytest.approx(100.)
    assert planned[2].start_v == pytest.approx(100.)
    on.calc_junction(into, 1e9)
    back.calc_junction(on, 1e9)
    assert back.max_start_v2 == 0.
    assert on.calc_position(0.) == pytest.approx((120., 100., 10., 0.))
    middle = on.calc_position(0.5 * arc.length / 100.)
    assert middle[:2] == pytest.approx([100. + 20. * math.sqrt(.5)] * 2)
    assert middle[3] == pytest.approx(0.5)


def home(it):
    it.toolhead.set_position([100., 100., 10., 0.], "xyz")
    return it.toolhead.get_kinematics()


def check(kin, arc):
    move = make_arc_move(LIMITS, arc, 0., 0., 300.)
    kin.check_arc(move)
    return move


def check_linear(it):
    kin = home(it)
    assert kin.accepts_arc(make_arc())
    with pytest.raises(CommandError, match=r"the arc goes to X 225.000, which is not"
                       r" within -5.000 to 220.000"):
        check(kin, make_arc(center=(205., 100.), first=-1., sweep=2.))
    # the same ends the other way round
    check(kin, make_arc(center=(205., 100.), first=-1.9, sweep=-2.))
    # to the very end of the range
    check(kin, make_arc(center=(200., 100.), first=-1., sweep=2.))
    flat = check(kin, make_arc())
    assert flat.accel == 3000. and flat.max_cruise_v2 == pytest.approx(60000.)
    helix = check(kin, make_arc(z=(10., 15.)))
    ratio = helix.move_d / 5.
    assert math.sqrt(helix.max_cruise_v2) == pytest.approx(min(15. * ratio, 244.9),
                                                           rel=1e-3)
    assert helix.accel == pytest.approx(min(3000., 200. * ratio))
    # upright: z is as fast as the head, and pulled towards the middle
    upright = ArcPath((100., 100., 30.), (80., 100., 30.), (30., 90.), math.pi, 1)
    move = check(kin, upright)
    assert move.max_cruise_v2 == pytest.approx(15. ** 2)
    assert move.accel == pytest.approx(200.)
    kin.clear_homing_state("y")
    with pytest.raises(CommandError, match="Must home axis first"):
        check(kin, make_arc())


def test_linear_machines(tmp_path, monkeypatch):
    bench = motion_bench.MotionBench(tmp_path, monkeypatch,
                                     make_axes("corexy", 0., BED))
    bench.run_ready(check_linear)


def check_delta(it):
    toolhead = it.toolhead
    toolhead.set_position([0., 0., 10., 0.], "xyz")
    kin = toolhead.get_kinematics()
    reach = kin.max_radius
    check(kin, make_arc((0., 0.), reach, sweep=2. * math.pi))
    with pytest.raises(CommandError, match="from the center, which is more than"):
        check(kin, make_arc((0.5 * reach, 0.), 0.51 * reach, first=-1., sweep=2.))
    slowed = check(kin, make_arc((0., 0.), 0.99 * reach))
    assert slowed.accel < 3000.
    with pytest.raises(CommandError, match="is below"):
        check(kin, make_arc((0., 0.), 10., z=(1., -50.)))
    top = kin.max_z - 1.
    with pytest.raises(CommandError, match="past its endstop"):
        check(kin, make_arc((0., 0.), 60., sweep=2. * math.pi, z=(top, top)))
    assert not kin.accepts_arc(make_arc((0., 0.), 5., z=(top - 1., top)))
    assert kin.accepts_arc(make_arc((0., 0.), 5., z=(10., 12.)))
    assert not kin.accepts_arc(ArcPath((0., 0., 30.), (-20., 0., 30.), (30., -10.),
                                       math.pi, 1))
    kin.clear_homing_state("x")
    with pytest.raises(CommandError, match="Must home axis first"):
        check(kin, make_arc((0., 0.), 5.))


def test_delta(tmp_path, monkeypatch):
    bench = motion_bench.MotionBench(tmp_path, monkeypatch, make_delta(0., BED))
    bench.run_ready(check_delta)


def check_limited(it):
    kin = home(it)
    kin.axis_limits.velocities = [150., 70.]
    kin.axis_limits.accels = [2500., 900.]
    # x alone is along the way at the top, and both count all round
    short = ArcPath((100., 120., 10.), (102., 119.9, 10.),
                    (100., 100. + (20. ** 2 - 2. ** 2) ** .5 - 20.), -0.1, 2)
    assert kin.accepts_arc(short)
    round_ = check(kin, make_arc(sweep=6.))
    assert math.sqrt(round_.max_cruise_v2) == pytest.approx(70.)
    assert round_.accel == pytest.approx(1. / (1. / 2500. + 1. / 900.))
    small = check(kin, make_arc(radius=1., sweep=6.))
    assert small.max_cruise_v2 == pytest.approx(small.accel)
    # from the right end upwards: most of y, little of x; pulled along x
    right = check(kin, make_arc(radius=20., first=-0.05, sweep=0.1))
    assert math.sqrt(right.max_cruise_v2) == pytest.approx(70.)
    assert right.accel == pytest.approx(1. / (math.sin(.05) / 2500. + 1. / 900.))
    # where y is pulled but does not lead
    top = check(kin, make_arc(radius=2., first=0.5 * math.pi - .05, sweep=0.1))
    assert top.accel == pytest.approx(1. / (1. / 2500. + math.sin(.05) / 900.))
    assert top.max_cruise_v2 == pytest.approx(
        2. / (math.sin(.05) / 2500. + 1. / 900.))
    with pytest.raises(CommandError, match="the arc goes to X"):
        check(kin, make_arc(center=(205., 100.), first=-1., sweep=2.))


def test_limited_machines(tmp_path, monkeypatch):
    bench = motion_bench.MotionBench(tmp_path, monkeypatch,
                                     make_axes("limited_corexy", 0., BED))
    bench.run_ready(check_limited)


def check_deltesian(it):
    kin = home(it)
    low, high = kin.limits.get_range(0)
    it.toolhead.set_position([0., 100., 10., 0.], "xyz")
    ratio = kin.find_ratio(20.)
    kin.slow_ratio = 1.01 * ratio
    fast = check(kin, make_arc((0., 100.), 20., sweep=6.))
    kin.slow_ratio = 0.99 * ratio
    slow = check(kin, make_arc((0., 100.), 20., sweep=6.))
    assert fast.accel == 3000. and slow.accel == 0.5 * kin.max_accel
    assert kin.find_ratio(high) > ratio
    with pytest.raises(CommandError, match="the arc goes to X"):
        check(kin, make_arc((high - 10., 100.), 20., first=-1., sweep=2.))
    top = kin.limits.get_range(2)[1]
    column = kin.columns[0]
    clear = column.top - math.sqrt(column.arm2)
    assert kin.accepts_arc(make_arc((0., 100.), 5., z=(10., 10.5)))
    assert not kin.accepts_arc(make_arc((0., 100.), 5., z=(top - 1., top)))
    assert kin.accepts_arc(make_arc((0., 100.), 5., z=(top, top)))
    assert clear < top
    with pytest.raises(CommandError, match="past its endstop"):
        check(kin, make_arc((0., 100.), 90., sweep=6., z=(top, top)))


def test_deltesian(tmp_path, monkeypatch):
    bench = motion_bench.MotionBench(tmp_path, monkeypatch,
                                     make_curved("deltesian", 0., BED))
    bench.run_ready(check_deltesian)


def check_rotary_delta(it):
    it.toolhead.set_position([0., 0., 10., 0.], "xyz")
    kin = it.toolhead.get_kinematics()
    reach = kin.max_radius
    check(kin, make_arc((0., 0.), reach, sweep=2. * math.pi))
    with pytest.raises(CommandError, match="from the center, which is more than"):
        check(kin, make_arc((0.5 * reach, 0.), 0.51 * reach, first=-1., sweep=2.))
    with pytest.raises(CommandError, match="is below"):
        check(kin, make_arc((0., 0.), 10., z=(1., -50.)))
    arc = make_arc((0., 0.), 0.99 * reach, sweep=6., z=(-2., -2.))
    worst = max(kin.find_ratio(*point) for point in sample(arc, 1001))
    assert worst > 3.
    slowed = check(kin, arc)
    assert slowed.accel == pytest.approx(min(3000., kin.max_accel * 3. / worst),
                                         rel=0.01)
    assert kin.accepts_arc(make_arc((0., 0.), 5., z=(10., 12.)))
    assert not kin.accepts_arc(ArcPath((0., 0., 30.), (-20., 0., 30.), (30., -10.),
                                       math.pi, 1))
    top = kin.home_position[2]
    with pytest.raises(CommandError, match="past its endstop"):
        check(kin, make_arc((0., 0.), 40., sweep=6., z=(top, top)))
    assert not kin.accepts_arc(make_arc((0., 0.), 40., sweep=6., z=(top - 1., top)))


def test_rotary_delta(tmp_path, monkeypatch):
    bench = motion_bench.MotionBench(tmp_path, monkeypatch,
                                     make_curved("rotary_delta", 0., BED))
    bench.run_ready(check_rotary_delta)


def check_polar(it):
    it.toolhead.set_position([60., 0., 10., 0.], "xyz")
    kin = it.toolhead.get_kinematics()
    bed = kin.max_angular_velocity
    assert kin.accepts_arc(make_arc((0., 0.), 1., sweep=6.))
    assert not kin.accepts_arc(make_arc((3., 0.), 2., sweep=6.))    # 1 to 5 mm
    assert kin.accepts_arc(make_arc((60., 0.), 20., sweep=6.))
    assert not kin.accepts_arc(make_arc((0., 0.), 0.005, sweep=6.))
    slow = check(kin, make_arc((0., 0.), 1., sweep=6.))
    assert math.sqrt(slow.max_cruise_v2) == pytest.approx(bed)
    free = check(kin, make_arc((60., 0.), 20., sweep=6.))
    assert free.max_cruise_v2 == pytest.approx(60000.)
    with pytest.raises(CommandError, match="from the center is more"):
        check(kin, make_arc((100., 100.), 20., sweep=2.))


def test_polar(tmp_path, monkeypatch):
    bench = motion_bench.MotionBench(tmp_path, monkeypatch,
                                     make_curved("polar", 0., BED))
    bench.run_ready(check_polar)


def check_who_follows(it):
    toolhead, kin = it.toolhead, home(it)
    arc = make_arc()
    assert toolhead.can_follow(arc)
    kin.check_move = lambda move: 0
    assert not toolhead.can_follow(arc)
    del kin.check_move
    assert toolhead.can_follow(arc)
    toolhead.kin = type("Own", (type(kin),), {"check_move": lambda s, m: 0}).__new__(
        type("Own", (type(kin),), {"check_move": lambda s, m: 0}))
    assert not toolhead.can_follow(arc)
    toolhead.kin = kin


def test_who_replaces_check_move_gets_segments(tmp_path, monkeypatch):
    bench = motion_bench.MotionBench(tmp_path, monkeypatch,
                                     make_axes("cartesian", 0., BED))
    bench.run_ready(check_who_follows)
