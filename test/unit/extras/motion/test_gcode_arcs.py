# SPDX-License-Identifier: GPL-3.0-or-later
import math

import pytest
from coordinates import make_printer
from hypothesis import given, settings
from hypothesis import strategies as st

from klippy.errors import CommandError
from klippy.extras import gcode_arcs


def load(**options):
    """A printer whose arcs are cut into moves."""
    return make_printer(("gcode_arcs", {"native": "False", **options}))


@pytest.fixture
def printer():
    made = load()
    yield made
    made.close()


def run(printer, script):
    """Run a script; returns the moves it made, with where the head was."""
    moves = [(*printer.toolhead.position, 0.)]
    printer.toolhead.moves = moves
    printer.gcode.run_script(script)
    return moves


def check_points(moves, center, radius, axes=(0, 1)):
    for move in moves:
        assert math.dist([move[i] for i in axes], center) == pytest.approx(radius)


def test_quarter_counter_clockwise(printer):
    run(printer, "G1 X10 Y0 F1200")
    moves = run(printer, "G3 X0 Y10 I-10 J0 E2")
    check_points(moves, (0., 0.), 10.)
    assert len(moves) == 17
    assert moves[-1] == (0., 10., 0., 2., 20.)
    # e is spread evenly, and so is the angle
    assert [m[3] for m in moves] == pytest.approx([2. * i / 16 for i in range(17)])
    assert [math.atan2(m[1], m[0]) for m in moves] == pytest.approx(
        [math.pi / 2. * i / 16 for i in range(17)])


def test_the_other_way_round_is_three_quarters(printer):
    run(printer, "G1 X10 Y0")
    moves = run(printer, "G2 X0 Y10 I-10")
    assert len(moves) == 1 + math.ceil(15. * math.pi)
    check_points(moves, (0., 0.), 10.)
    assert moves[len(moves) // 2][1] < 0.
    assert {m[3] for m in moves} == {0.} and {m[2] for m in moves} == {0.}


@pytest.mark.parametrize("command, sign", [("G2", -1.), ("G3", 1.)])
def test_full_circle_and_helix(printer, command, sign):
    run(printer, "G1 X5 Y5")
    moves = run(printer, "%s I-5 J0 Z3 F600 E1" % command)
    check_points(moves, (0., 5.), 5.)
    assert moves[1][1] * sign > 5. * sign
    assert moves[-1] == (5., 5., 3., 1., 10.)
    rises = [b[2] - a[2] for a, b in zip(moves, moves[1:], strict=False)]
    assert rises == pytest.approx([3. / len(rises)] * len(rises))


@pytest.mark.parametrize("plane, axes, script", [
    ("G17", (0, 1), "X-2 Y2 I-2 J0"), ("G18", (0, 2), "X-2 Z2 I-2 K0"),
    ("G19", (1, 2), "Y-2 Z2 J-2 K0")])
def test_planes(printer, plane, axes, script):
    run(printer, plane)
    moves = run(printer, "G3 " + script)
    center = (-2., 0.)
    check_points(moves, center, 2., axes)
    middle = moves[len(moves) // 2]
    assert middle[axes[0]] > -2. and middle[axes[1]] > 0.
    other = ({0, 1, 2} - set(axes)).pop()
    assert {m[other] for m in moves} == {0.}


def test_no_move_is_longer_than_the_resolution():
    printer = load(resolution="0.2")
    moves = run(printer, "G2 X8 Y0 I4 J0 Z1")
    lengths = [math.dist(a[:3], b[:3]) for a, b in zip(moves, moves[1:],
                                                       strict=False)]
    assert max(lengths) <= 0.2 and min(lengths) > 0.19
    printer.close()


def test_small_circles_stay_round(printer):
    moves = run(printer, "G2 I0.1")
    assert len(moves) == 17
    check_points(moves, (0.1, 0.), 0.1)


def test_offsets_and_factors(printer):
    run(printer, "G1 X10 Y10 E5\nG92 X0 Y0 E1\nM221 S50\nM220 S50")
    moves = run(printer, "G3 X0 Y10 I0 J5 E3 F600")
    check_points(moves, (10., 15.), 5.)
    assert moves[-1] == (10., 20., 0., 6., pytest.approx(5.))
    moves = run(printer, "M83\nG2 X0 Y0 J-5 E1")
    assert moves[-1][:4] == (10., 10., 0., 6.5)


def test_end_off_the_circle_is_reached_evenly():
    printer = load(spiral_tolerance="1")
    run(printer, "G1 X10 Y0")
    moves = run(printer, "G3 X0 Y11 I-10")
    assert moves[-1][:2] == (0., 11.)
    radii = [math.hypot(*m[:2]) for m in moves]
    assert radii == pytest.approx([10. + i / (len(moves) - 1)
                                   for i in range(len(moves))])
    printer.close()


def test_end_too_far_off_the_circle_is_an_error(printer):
    run(printer, "G1 X10 Y0")
    moves = run(printer, "G3 X0 Y10.5 I-10")
    assert moves[-1][:2] == (0., 10.5)
    run(printer, "G1 X10 Y0")
    with pytest.raises(CommandError, match=r"end is 10.510 mm .* start 10.000 mm.*"
                       r"differs by 0.510 mm .*0.500.*'spiral_tolerance'"):
        printer.gcode.run_script("G3 X0 Y10.51 I-10")
    assert list(printer.gcode_move.last_position) == printer.toolhead.position


@pytest.mark.parametrize("line, words", [
    ("G91\nG2 X1 I1", "relative"), ("G2 X5 R2", "at least half"),
    ("G2 R5", "must differ"), ("G2 X5 R5 I1", "not both"), ("G2 X5 R0", "no arc"),
    ("G3 X5", "IJ"),
    ("G2 X5 I0 J0", "IJ"), ("G2 X5 K1", "IJ"), ("G18\nG2 X5 J1", "IK"),
    ("G2 Xnan I1", "X="), ("G2 X5 I", "I="), ("G2 X5 I1 F0", "F is 0"),
    ("G2 I" + "9" * 12, "moves")])
def test_errors_make_no_move(printer, line, words):
    with pytest.raises(CommandError, match=words):
        printer.gcode.run_script(line)
    assert printer.toolhead.moves == []


@pytest.mark.parametrize("command, radius, center", [
    ("G3", 10., (0., 0.)), ("G3", -10., (10., 10.)),
    ("G2", 10., (10., 10.)), ("G2", -10., (0., 0.))])
def test_radius_and_its_sign(printer, command, radius, center):
    """From (10, 0) to (0, 10): a quarter, or three quarters if negative."""
    run(printer, "G1 X10 Y0")
    moves = run(printer, "%s X0 Y10 R%g E1 Z2" % (command, radius))
    check_points(moves, center, 10.)
    assert moves[-1][:4] == (0., 10., 2., 1.)
    way = sum(math.dist(a[:2], b[:2]) for a, b in zip(moves, moves[1:], strict=False))
    quarters = 1. if radius > 0. else 3.
    assert way == pytest.approx(quarters * 5. * math.pi, rel=0.01)


@pytest.mark.parametrize("plane, axes, letters", [("G18", (0, 2), "XZ"),
                                                  ("G19", (1, 2), "YZ")])
def test_radius_in_other_planes(printer, plane, axes, letters):
    run(printer, "%s\nG1 %s10" % (plane, letters[0]))
    moves = run(printer, "G3 %s0 %s10 R10" % tuple(letters))
    check_points(moves, (0., 0.), 10., axes)


def test_half_circle_may_be_rounded(printer):
    moves = run(printer, "G2 X10.001 R5")
    check_points(moves, (5.0005, 0.), 5.0005)
    assert max(m[1] for m in moves) == pytest.approx(5., rel=0.02)


@pytest.mark.parametrize("radius", [0.5, 8., 120.])
def test_chord_error_is_kept(radius):
    printer = load(resolution="100", chord_error="0.01")
    moves = run(printer, "G2 X%g Y0 R%g" % (2. * radius, radius))
    off = [radius - math.hypot(0.5 * (a[0] + b[0]) - radius, 0.5 * (a[1] + b[1]))
           for a, b in zip(moves, moves[1:], strict=False)]
    # No more than asked for, and not in needlessly many moves
    assert 0.006 < max(off) <= 0.01 + 1e-9
    printer.close()


def test_refused_move_ends_the_arc(printer):
    run(printer, "G1 X999 Y0")
    moves = run(printer, "G1 X999")
    with pytest.raises(CommandError, match="out of range"):
        printer.gcode.run_script("G2 X999 Y-20 I0 J-10")
    assert moves[-1][0] <= 1000.
    assert list(printer.gcode_move.last_position) == printer.toolhead.position


angles = st.floats(0., 2. * math.pi)


@settings(max_examples=200, deadline=None)
@given(angles, angles, st.floats(0.01, 200.), st.booleans())
def test_arcs_go_the_asked_way(first, last, radius, is_clockwise):
    start = [radius * math.cos(first), radius * math.sin(first), 0.]
    end = [radius * math.cos(last), radius * math.sin(last), 1.]
    arc = gcode_arcs.Arc(start, end, [-start[0], -start[1]], (0, 1, 2), is_clockwise)
    assert 0. < abs(arc.angle) <= 2. * math.pi + 1e-9
    assert (arc.angle < 0.) == is_clockwise
    x, y, z = arc.find_point(0.5)
    assert math.hypot(x, y) == pytest.approx(radius)
    assert z == pytest.approx(0.5)
    assert arc.find_point(1.) == pytest.approx(end, abs=1e-6 * radius + 1e-6)
