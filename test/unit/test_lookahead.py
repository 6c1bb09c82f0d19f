# SPDX-License-Identifier: GPL-3.0-or-later
"""The planner against a slow planner written from the page on motion."""

import math

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from truth import gcode
from truth import plan as truth

from klippy.errors import CommandError
from klippy.lookahead import LookAheadQueue, MotionLimits, Move

FREE = 1e99
LIMITS = gcode.Limits(300., 3000., max_z_velocity=25., max_z_accel=100.,
                      filament_velocity=60., filament_accel=800.)


def make_move(wanted):
    """The planner's Move, limited as kinematics and extruder do."""
    lim = wanted.limits
    shared = MotionLimits(lim.max_velocity, lim.max_accel, lim.cruise_ratio,
                          lim.corner_velocity)
    move = Move(shared, wanted.start, wanted.end, wanted.speed)
    if not move.move_d:
        return None
    rx, ry, rz, r = move.axes_r
    if rz:
        move.limit_speed(lim.max_z_velocity / abs(rz), lim.max_z_accel / abs(rz))
    if r and (not (move.axes_d[0] or move.axes_d[1]) or r < 0.):
        move.limit_speed(lim.filament_velocity / abs(r), lim.filament_accel / abs(r))
    return move


def corner_limit(before, after, jump):
    change = abs(after.axes_r[3] - before.axes_r[3])
    return (jump / change) ** 2 if change else FREE


def run_planner(wanted, take_each=None):
    """Moves in the order in which they leave the queue.

    take_each: ask for certain moves after every so many moves; None: when the
    queue asks for it.
    """
    queue, planned = LookAheadQueue(), []
    for i, w in enumerate(wanted):
        move = make_move(w)
        if move is None:
            continue
        last = queue.get_last()
        if last is not None:
            move.calc_junction(last, corner_limit(last, move, w.limits.filament_jump))
        is_due = queue.add_move(move)
        if (i + 1) % take_each == 0 if take_each else is_due:
            planned += queue.take(False)
    return planned + queue.take(True)


def speeds(move):
    return (move.start_v, move.cruise_v, move.cruise_v - move.accel * move.decel_t)


def compare(wanted):
    expected = truth.plan(wanted)
    moves = run_planner(wanted)
    assert len(moves) == len(expected)
    for i, (move, e) in enumerate(zip(moves, expected, strict=True)):
        # As squares: right back, rounding decides between 0 and 0.001 mm/s
        want = (e.v_start ** 2, e.v_cruise ** 2, e.v_end ** 2)
        assert [v * v for v in speeds(move)] == pytest.approx(
            want, rel=2e-6, abs=1e-5), i
        assert move.accel == pytest.approx(e.a, rel=1e-12)
        assert trapezoid_length(move) == pytest.approx(e.d, rel=1e-9, abs=1e-9)


def trapezoid_length(move):
    end_v = move.cruise_v - move.accel * move.decel_t
    return (0.5 * (move.start_v + move.cruise_v) * move.accel_t
            + move.cruise_v * move.cruise_t
            + 0.5 * (move.cruise_v + end_v) * move.decel_t)


def chain(ways, limits=LIMITS, start=(10., 10., 1., 0.)):
    """Wanted moves from ((dx, dy, dz, de), speed, limit changes) each."""
    wanted, position = [], start
    for delta, speed, changes in ways:
        end = tuple(p + q for p, q in zip(position, delta, strict=True))
        own = gcode.dataclasses.replace(limits, **changes) if changes else limits
        wanted.append(gcode.Wanted(position, end, speed, own))
        position = end
    return wanted


# Random jobs

lengths = st.one_of(st.floats(0.005, 0.3), st.floats(0.3, 5.), st.floats(5., 150.))
fixed_angle = st.sampled_from([0., math.pi / 2., math.pi, -math.pi / 2.])
angles = st.one_of(st.floats(-math.pi, math.pi), st.floats(-0.2, 0.2), fixed_angle)
rates = st.sampled_from([1., 10., 40., 100., 250., 500.])


@st.composite
def strokes(draw):
    """One stretch of a job: ((turn, length, dz, de), speed) of each move."""
    kind = draw(st.sampled_from(["line", "arc", "zigzag", "retract", "lift", "slope"]))
    speed = draw(rates)
    if kind == "arc":
        turn, length = draw(st.floats(-0.3, 0.3)), draw(st.floats(0.01, 0.8))
        flow = draw(st.sampled_from([0., 0.03]))
        return [((turn, length, 0., flow * length), speed)
                ] * draw(st.integers(2, 40))
    if kind == "zigzag":
        length = draw(st.floats(0.1, 20.))
        return [((2.9 * (-1) ** i, length, 0., 0.04 * length), speed)
                for i in range(draw(st.integers(2, 12)))]
    if kind == "retract":
        return [((0., 0., 0., draw(st.sampled_from([-0.8, 0.8, 2.]))), speed)]
    if kind == "lift":
        return [((0., 0., draw(st.sampled_from([-0.2, 0.2, 1.])), 0.), speed)]
    turn, length = draw(angles), draw(lengths)
    dz = draw(st.floats(-0.5, 0.5)) if kind == "slope" else 0.
    return [((turn, length, dz, draw(st.sampled_from([-0.01, 0., 0.02, 0.05]))
              * length), speed)]


accel_changes = st.one_of(st.just({}), st.builds(
    lambda a: {"max_accel": a}, st.sampled_from([100., 500., 8000.])))


@st.composite
def jobs(draw):
    """Random Wanted moves."""
    base = gcode.dataclasses.replace(
        LIMITS, cruise_ratio=draw(st.sampled_from([0., 0.5, 0.9])),
        corner_velocity=draw(st.sampled_from([0., 5., 20.])))
    heading, ways = 0., []
    for _ in range(draw(st.integers(1, 14))):
        changes = draw(accel_changes)
        for (turn, length, dz, de), speed in draw(strokes()):
            heading += turn
            ways.append(((length * math.cos(heading), length * math.sin(heading),
                          dz, de), speed, changes))
    return chain(ways, base)


@pytest.mark.parametrize(("turn", "is_corner"), [(0.8e-6, False), (5e-6, True)])
def test_a_turn_below_rounding_is_straight(turn, is_corner):
    limits = gcode.dataclasses.replace(LIMITS, corner_velocity=0.)
    wanted = chain([((5., 0., 0., 0.), 10., None),
                    ((5., 5. * turn, 0., 0.), 10., None)], limits)
    compare(wanted)
    assert speeds(run_planner(wanted)[0])[2] == (0. if is_corner else 10.)


@settings(max_examples=250, deadline=None)
@given(jobs())
def test_speeds_follow_the_page(wanted):
    planned = truth.plan(wanted)
    assume(not any(truth.is_nearly_straight(p, q)
                   for p, q in zip(planned, planned[1:], strict=False)))
    compare(wanted)


@settings(max_examples=120, deadline=None)
@given(jobs(), st.integers(1, 7))
def test_plan_does_not_depend_on_when_it_is_made(wanted, take_each):
    once = [speeds(m) for m in run_planner(wanted, take_each=10 ** 9)]
    assert [speeds(m) for m in run_planner(wanted, take_each=take_each)] == once
    assert [speeds(m) for m in run_planner(wanted)] == once


# Single cases

def line(*lengths_mm, speed=100., **changes):
    return chain([((d, 0., 0., 0.), speed, changes) for d in lengths_mm])


def plan_speeds(wanted):
    compare(wanted)
    return [speeds(m) for m in run_planner(wanted)]


def test_long_move_reaches_its_speed():
    assert plan_speeds(line(50., cruise_ratio=0.)) == [pytest.approx((0., 100., 0.))]


def test_short_move_peaks_at_gentle_acceleration():
    (_, peak, _), = plan_speeds(line(1., cruise_ratio=0.5))
    assert peak == pytest.approx(math.sqrt(1500. * 1.))
    (_, peak, _), = plan_speeds(line(1., cruise_ratio=0.))
    assert peak == pytest.approx(math.sqrt(3000. * 1.))


def test_straight_junction_is_passed_at_full_speed():
    first, second = plan_speeds(line(50., 50.))
    assert first[2] == pytest.approx(100.) and second[0] == pytest.approx(100.)


def test_right_angle_is_passed_at_corner_velocity():
    wanted = chain([((50., 0., 0., 0.), 100., {}), ((0., 50., 0., 0.), 100., {})])
    first, second = plan_speeds(wanted)
    assert first[2] == pytest.approx(5.) and second[0] == pytest.approx(5.)


def test_reversal_and_filament_alone_stop():
    back = chain([((5., 0., 0., 0.), 100., {}), ((-5., 0., 0., 0.), 100., {})])
    assert plan_speeds(back)[0][2] == pytest.approx(0., abs=1e-9)
    pull = chain([((5., 0., 0., 0.), 100., {}), ((0., 0., 0., -1.), 30., {}),
                  ((5., 0., 0., 0.), 100., {})])
    (_, _, end), (start, cruise, stop), _ = plan_speeds(pull)
    assert (end, start, stop) == pytest.approx((0., 0., 0.), abs=1e-9)
    assert cruise == pytest.approx(math.sqrt(800.))


def test_filament_pace_limits_a_straight_junction():
    wanted = chain([((20., 0., 0., 1.), 100., {}), ((20., 0., 0., 3.), 100., {})])
    assert plan_speeds(wanted)[1][0] == pytest.approx(1. / 0.1)


def test_no_way_is_no_move():
    queue = LookAheadQueue()
    move = Move(MotionLimits(100., 1000., 0.5, 5.), (1., 2., 3., 4.),
                (1., 2., 3., 4.), 50.)
    assert move.move_d == 0. and queue.take(True) == []


def test_certain_moves_leave_before_the_end():
    wanted = chain([((5., 5. * (-1) ** i, 0., 0.), 100., {}) for i in range(100)])
    queue, left = LookAheadQueue(), []
    for w in wanted:
        move, last = make_move(w), queue.get_last()
        if last is not None:
            move.calc_junction(last, FREE)
        queue.add_move(move)
        left.append(len(queue.take(False)))
    assert sum(left) > 80 and len(queue) == len(wanted) - sum(left)
    assert not queue.is_empty() and queue.get_last() is not None


@pytest.mark.parametrize("corner", [0., 5.])
def test_rounding_does_not_tell_plans_apart(corner):
    for count in range(2, 40):
        wanted = line(*[0.6004543] * count, speed=250., cruise_ratio=0.,
                      corner_velocity=corner)
        once = [speeds(m) for m in run_planner(wanted, take_each=10 ** 9)]
        assert [speeds(m) for m in run_planner(wanted, take_each=1)] == once


def test_straight_line_does_not_stop_for_rounding():
    wanted = chain([((0.2135 * k, 0.13 * k, 0., 0.), 100., {})
                    for k in (1., 2., 2., 3.)],
                   gcode.dataclasses.replace(LIMITS, corner_velocity=0.))
    assert min(end for _, _, end in plan_speeds(wanted)[:-1]) > 10.


@given(st.floats(0., 0.4))
@example(0.)
def test_calc_position_runs_along_the_move(part):
    (move,) = run_planner(line(20.))
    total = move.accel_t + move.cruise_t + move.decel_t
    x, y, z, e = move.calc_position(total * part / 0.4)
    assert (y, z, e) == (10., 1., 0.) and 10. <= x <= 30.
    assert move.calc_position(total)[0] == pytest.approx(30.)
    assert move.calc_position(total * 0.5)[0] == pytest.approx(20.)


def test_move_error_names_the_target():
    (wanted,) = line(5.)
    error = make_move(wanted).move_error()
    assert isinstance(error, CommandError)
    assert str(error) == "Move out of range: 15.000 10.000 1.000 [0.000]"


def test_extra_axes_are_carried():
    limits = MotionLimits(100., 1000., 0.5, 5.)
    move = Move(limits, (0., 0., 0., 0., 1.), (3., 4., 0., 1., 11.), 50.)
    assert move.axes_d == [3., 4., 0., 1., 10.]
    assert move.axes_r == pytest.approx([0.6, 0.8, 0., 0.2, 2.])
    assert (move.start_pos, move.end_pos) == ((0., 0., 0., 0., 1.),
                                              (3., 4., 0., 1., 11.))


def test_callbacks_are_kept():
    (wanted,) = line(5.)
    move, calls = make_move(wanted), []
    move.add_callback(calls.append)
    move.add_callback(calls.append)
    assert move.timing_callbacks == [calls.append] * 2
